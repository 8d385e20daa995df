#pragma once

#include <optional>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/tracked_image.hpp"
#include "modules/core/map/occupancy_grid.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Maximum width of the image that is sent [px].
inline constexpr int kMaxViewWidth = 640;

/// The left image in grey, at most kMaxViewWidth wide, as a JPEG that fits into an update, with the
/// pixels of the features. `camera` is the camera of this image. Throws std::invalid_argument for
/// an image without pixels.
[[nodiscard]] ViewImage view_image(const TrackedImage& image, const Camera& camera);

/// The largest objects of the list that fit into an update.
[[nodiscard]] ViewObjects view_objects(const ObjectList& list);

/// The 2D map, reduced until it fits into an update: 2 x 2 cells become one. nullopt for an empty
/// map.
[[nodiscard]] std::optional<ViewRaster> view_raster(const OccupancyGrid& map);

}  // namespace km
