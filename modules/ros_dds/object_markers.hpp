#pragma once

#include <span>

#include "modules/core/label_palette.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// Draws objects: a transparent box in the colour of the class, and above it the name of the class.
/// The first marker deletes all others, so that the message is the full state.
[[nodiscard]] RosMarkerArray object_markers(std::span<const MapObject> objects,
                                            const LabelPalette& palette, const RosHeader& header);

}  // namespace km
