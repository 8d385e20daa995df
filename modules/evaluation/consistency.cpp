#include "modules/evaluation/consistency.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "modules/core/geometry/lie.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

// Trace of a covariance up to which a pose is skipped as the origin, relative to the largest trace.
constexpr double kOrigin = 1e-6;
constexpr double k95Of6 = 12.5916;  // quantile of chi-squared, 6 degrees of freedom
constexpr double kMedianOf6 = 5.34812;

struct Sample {
  std::vector<double> pose, rotation, translation;

  void add(const Vector6& e, const Matrix6& Sigma) {
    pose.push_back(e.dot(Sigma.ldlt().solve(e)));
    const Eigen::Vector3d w = e.head<3>(), v = e.tail<3>();
    rotation.push_back(w.dot(Sigma.topLeftCorner<3, 3>().ldlt().solve(w)));
    translation.push_back(v.dot(Sigma.bottomRightCorner<3, 3>().ldlt().solve(v)));
  }
  void add(const Sample& other) {
    pose.insert(pose.end(), other.pose.begin(), other.pose.end());
    rotation.insert(rotation.end(), other.rotation.begin(), other.rotation.end());
    translation.insert(translation.end(), other.translation.begin(), other.translation.end());
  }
};

Consistency summary(const std::string& name, const Sample& sample) {
  Consistency result{.name = name, .poses = sample.pose.size()};
  result.pose = statistics_of(sample.pose).mean / 6.0;
  result.rotation = statistics_of(sample.rotation).mean / 3.0;
  result.translation = statistics_of(sample.translation).mean / 3.0;
  result.median = statistics_of(sample.pose).median / kMedianOf6;
  for (const double x : sample.pose)
    result.share_within_95 += (x <= k95Of6 ? 1.0 : 0.0) / static_cast<double>(result.poses);
  return result;
}

// The rotation about z that is nearest to R.
Eigen::Matrix3d heading(const Eigen::Matrix3d& R) {
  const double yaw = std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
  return so3_exp(Eigen::Vector3d(0.0, 0.0, yaw));
}

SE3 place_in_truth(std::span<const ConsistencyInput> inputs, bool upright) {
  const ConsistencyInput* origin_of = nullptr;
  std::size_t origin = 0;
  for (const ConsistencyInput& input : inputs)
    for (std::size_t k = 0; k < input.covariances.size(); ++k)
      if (origin_of == nullptr ||
          input.covariances[k].trace() < origin_of->covariances[origin].trace()) {
        origin_of = &input;
        origin = k;
      }
  if (origin_of == nullptr) throw std::invalid_argument("no pose has a covariance");
  const StampedPose& pose = origin_of->estimate[origin];
  const auto truth = pose_at(origin_of->truth, pose.stamp);
  if (!truth)
    throw std::invalid_argument(origin_of->name + ": the truth has no pose at the origin");
  const SE3 T = *truth * pose.T.inverse();
  if (!upright) return T;
  const Eigen::Matrix3d R = heading(T.linear());
  return make_pose(R, truth->translation() - R * pose.T.translation());
}

}  // namespace

std::vector<Consistency> consistency(std::span<const ConsistencyInput> inputs, bool upright) {
  const SE3 T_truth_world = place_in_truth(inputs, upright);
  double largest = 0.0, smallest = std::numeric_limits<double>::infinity();
  for (const ConsistencyInput& input : inputs)
    for (const Matrix6& Sigma : input.covariances) {
      largest = std::max(largest, Sigma.trace());
      smallest = std::min(smallest, Sigma.trace());
    }
  // At most the tilt of the origin has a variance, so its covariance is singular.
  const double of_origin = std::max(kOrigin * largest, smallest);
  std::vector<Consistency> results;
  Sample all;
  for (const ConsistencyInput& input : inputs) {
    Sample sample;
    for (std::size_t k = 0; k < input.covariances.size(); ++k) {
      const StampedPose& pose = input.estimate[k];
      const auto truth = pose_at(input.truth, pose.stamp);
      if (!truth || input.covariances[k].trace() <= of_origin) continue;
      sample.add(se3_log((T_truth_world * pose.T).inverse() * *truth), input.covariances[k]);
    }
    if (sample.pose.empty())
      throw std::invalid_argument(input.name + ": shares no pose with its truth");
    all.add(sample);
    results.push_back(summary(input.name, sample));
  }
  results.push_back(summary("all", all));
  return results;
}

Consistency consistency_of_edges(const std::string& name, std::span<const RelativePose> edges,
                                 const std::map<KeyframeId, SE3>& truth) {
  Sample sample;
  for (const RelativePose& e : edges) {
    const auto from = truth.find(e.from), to = truth.find(e.to);
    if (from == truth.end() || to == truth.end()) continue;
    const SE3 T_from_to = from->second.inverse() * to->second;
    sample.add(se3_log(e.T_from_to.inverse() * T_from_to), e.covariance);
  }
  return summary(name, sample);
}

}  // namespace km
