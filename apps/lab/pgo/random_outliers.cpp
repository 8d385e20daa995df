#include "apps/lab/pgo/random_outliers.hpp"

#include <numbers>
#include <stdexcept>
#include <utility>

namespace km {
namespace {

// Two keyframes that are not consecutive, the earlier one first.
std::pair<std::uint32_t, std::uint32_t> random_pair(std::size_t keyframes, std::mt19937& rng) {
  std::uniform_int_distribution<std::size_t> keyframe(0, keyframes - 1);
  for (;;) {
    const auto i = static_cast<std::uint32_t>(keyframe(rng));
    const auto j = static_cast<std::uint32_t>(keyframe(rng));
    if (i + 1 < j) return {i, j};
    if (j + 1 < i) return {j, i};
  }
}

Eigen::Matrix3d random_rotation(bool planar, std::mt19937& rng) {
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  if (planar) return Eigen::AngleAxisd(angle(rng), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::normal_distribution<double> normal;  // uniform on the sphere of unit quaternions
  Eigen::Vector4d q;
  for (double& c : q) c = normal(rng);
  return Eigen::Quaterniond(q.normalized()).toRotationMatrix();
}

}  // namespace

std::vector<RelativePose> random_outliers(std::size_t count, const RandomOutlierModel& model,
                                          std::mt19937& rng) {
  if (model.keyframes < 3)
    throw std::invalid_argument("random_outliers: " + std::to_string(model.keyframes) +
                                " keyframes have no two that are not consecutive");
  std::uniform_real_distribution<double> coordinate(-model.half_side_m, model.half_side_m);
  std::vector<RelativePose> outliers;
  for (std::size_t n = 0; n < count; ++n) {
    const auto [i, j] = random_pair(model.keyframes, rng);
    const Eigen::Matrix3d R = random_rotation(model.planar, rng);
    Eigen::Vector3d t = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < (model.planar ? 2 : 3); ++axis) t(axis) = coordinate(rng);
    outliers.push_back({{model.robot, i}, {model.robot, j}, make_pose(R, t), model.covariance});
  }
  return outliers;
}

}  // namespace km
