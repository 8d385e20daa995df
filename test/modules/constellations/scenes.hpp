#pragma once

#include <algorithm>
#include <numbers>
#include <random>
#include <vector>

#include "modules/constellations/landmark.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// A true object of a scene.
struct TrueObject {
  LabelId label = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();
};

inline double drawn(std::mt19937& rng, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(rng);
}

inline double normal(std::mt19937& rng) {
  return std::normal_distribution<double>()(rng);
}

/// Size of an object of a label: 1 as a pole, 2 as a bench, 3 as a car.
inline Eigen::Vector3d size_of(LabelId label) {
  if (label == 1) return {0.3, 0.3, 3.0};
  return label == 2 ? Eigen::Vector3d(1.6, 0.6, 0.9) : Eigen::Vector3d(4.4, 1.8, 1.5);
}

/// `count` objects of three labels in a square of 40 m, on a ground at z = 0.
inline std::vector<TrueObject> square(std::size_t count, std::mt19937& rng) {
  std::vector<TrueObject> scene;
  for (std::size_t n = 0; n < count; ++n) {
    TrueObject object{.label = static_cast<LabelId>(1 + n % 3)};
    object.size_m = size_of(object.label);
    object.center.x() = drawn(rng, -20.0, 20.0);
    object.center.y() = drawn(rng, -20.0, 20.0);
    object.center.z() = 0.5 * object.size_m.z();
    scene.push_back(object);
  }
  return scene;
}

/// A street along x: cars in bays of 5.4 m, poles at both kerbs, and benches at the walls, on both
/// sides.
inline std::vector<TrueObject> street(std::mt19937& rng) {
  std::vector<TrueObject> scene;
  const auto put = [&](LabelId label, double x, double y) {
    const Eigen::Vector3d size = size_of(label);
    scene.push_back({label, {x, y, 0.5 * size.z()}, size});
  };
  for (const double side : {-1.0, 1.0}) {
    const double bay = drawn(rng, 0.0, 5.4);
    for (double x = -24.0 + bay; x < 24.0; x += 5.4)
      if (drawn(rng, 0.0, 1.0) < 0.6) put(3, x, 4.0 * side);
    for (double x = -24.0; x < 24.0; x += 4.2)
      if (drawn(rng, 0.0, 1.0) < 0.4) put(1, x + drawn(rng, 0.0, 4.2), 5.5 * side);
    for (double x = -24.0 + drawn(rng, 0.0, 12.0); x < 24.0; x += drawn(rng, 8.0, 16.0))
      put(2, x, 8.0 * side);
  }
  return scene;
}

/// Errors of the map of a robot.
struct MapErrors {
  double found = 1.0;  ///< Probability that an object is in the map.
  std::size_t false_objects = 0;
  double sigma_m = 0.1;  ///< Independent error of each coordinate.
  double share = 0.1;    ///< Stated standard deviation of the shift, as a share of the sides.
  /// Shift of all centres along the horizontal axes and z, as a multiple of the stated deviation.
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// The map of a robot whose frame has the pose T_scene_map in the scene, in random order.
inline std::vector<Landmark> map_of(const std::vector<TrueObject>& scene, const SE3& T_scene_map,
                                    const MapErrors& errors, std::mt19937& rng) {
  std::vector<Landmark> map;
  const auto put = [&](const TrueObject& object) {
    Landmark landmark{.label = object.label, .size_m = object.size_m, .sigma_m = errors.sigma_m};
    landmark.side_shift_m = errors.share * object.size_m.x();
    landmark.height_shift_m = errors.share * object.size_m.z();
    const Eigen::Vector3d deviation(landmark.side_shift_m, landmark.side_shift_m,
                                    landmark.height_shift_m);
    Eigen::Vector3d error = errors.shift.cwiseProduct(deviation);
    for (double& e : error) e += errors.sigma_m * normal(rng);
    landmark.center = T_scene_map.inverse() * (object.center + error);
    map.push_back(landmark);
  };
  for (const TrueObject& object : scene)
    if (drawn(rng, 0.0, 1.0) < errors.found) put(object);
  for (const TrueObject& object : square(errors.false_objects, rng)) put(object);
  std::ranges::shuffle(map, rng);
  return map;
}

/// Any heading and a position within 30 m.
inline SE3 random_upright(std::mt19937& rng) {
  const double yaw = drawn(rng, -std::numbers::pi, std::numbers::pi);
  Eigen::Vector3d t;
  for (double& c : t) c = drawn(rng, -30.0, 30.0);
  return make_pose(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix(), t);
}

}  // namespace km
