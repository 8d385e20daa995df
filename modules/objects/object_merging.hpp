#pragma once

#include <vector>

#include "modules/objects/map_object.hpp"
#include "modules/objects/objects_config.hpp"

namespace km {

/// Replaces objects that are copies or parts of one (same layer and class, overlapping boxes) by
/// one, until no two are. The box of the result contains the boxes of its parts. Its views are
/// their sum, and its surface and keyframe are those of the part with most surface. The result does
/// not depend on the order of robots with unequal surfaces. Quadratic in the number of objects.
[[nodiscard]] std::vector<MapObject> merge_objects(std::vector<MapObject> objects,
                                                   const ObjectsConfig& config);

}  // namespace km
