#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/objects/map_object.hpp"

namespace km {

/// Upright box of an object in `world`, see ObjectBox.
struct ViewObject {
  LabelId label = 0;
  Eigen::Vector3f center = Eigen::Vector3f::Zero();  ///< [m]
  float yaw_rad = 0.0F;
  Eigen::Vector3f size_m = Eigen::Vector3f::Zero();
  std::vector<RobotId> robots = {};  ///< Robots that saw it.
};

/// The objects of the team as one robot knows them; the newest list in a frame counts.
struct ViewObjects {
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::vector<ViewObject> objects = {};
  std::uint32_t left_out = 0;  ///< Number of smaller objects for which there was no room.
};

/// The largest objects of the list that fit into an update.
[[nodiscard]] ViewObjects view_objects(const ObjectList& list);

}  // namespace km
