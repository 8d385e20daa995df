#pragma once

#include <cstdint>
#include <vector>

#include "modules/core/data/surface_keyframe.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/objects/object_box.hpp"

namespace km {

/// Layer of a scene graph to which an entry belongs. Only objects are extracted; other layers
/// (places, rooms) will have other numbers.
enum class SceneLayer : std::uint8_t { kObject = 0 };

/// A connected surface of one class.
struct MapObject {
  SceneLayer layer = SceneLayer::kObject;
  LabelId label = 0;
  ObjectBox box;             ///< In `world`.
  double surface_m2 = 0.0;   ///< Mapped surface. After a merge, that of the part with most surface.
  std::uint32_t views = 0;   ///< Number of keyframes that may have seen it, over all robots.
  KeyframeId keyframe = {};  ///< Keyframe with which the object moves.
  std::vector<RobotId> robots = {};  ///< Robots that saw it, ascending.
};

/// The objects of several robots.
struct ObjectList {
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::vector<MapObject> objects;
};

/// An object as its robot sends it: relative to a keyframe of this robot, so that it moves when the
/// poses are corrected.
struct AnchoredObject {
  SceneLayer layer = SceneLayer::kObject;
  LabelId label = 0;
  KeyframeIndex keyframe = 0;
  SE3 T_kf_box = SE3::Identity();    ///< Pose of the box in the keyframe.
  SE3 T_world_kf = SE3::Identity();  ///< Pose of the keyframe when the message was made.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  double surface_m2 = 0.0;
  std::uint32_t views = 0;
};

/// All objects that one robot has mapped; the newest message of a robot counts.
struct RobotObjects {
  RobotId robot = 0;
  std::uint64_t boot = 0;
  RobotId anchor = 0;  ///< Robot whose odometry frame is the frame of T_world_kf.
  std::vector<AnchoredObject> objects;
  /// Keyframes of some objects with their odometry, ascending.
  std::vector<SurfaceKeyframe> keyframes = {};
};

/// Largest number of objects of a robot in a message.
inline constexpr std::size_t kMaxObjects = 1000;

/// Largest number of keyframes with odometry in a message.
inline constexpr std::size_t kMaxObjectKeyframes = 200;

}  // namespace km
