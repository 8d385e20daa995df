#include "modules/evaluation/surroundings_alignment.hpp"

#include <stdexcept>
#include <string>

namespace km {
namespace {

TimeWindow window_of(const TrajectoryInput& input) {
  if (input.truth.empty()) throw std::invalid_argument(input.name + ": the truth holds no pose");
  return input.window.value_or(TimeWindow{input.truth.front().stamp, input.truth.back().stamp});
}

}  // namespace

SE3 align_surroundings(std::span<const TrajectoryInput> inputs, double radius_m,
                       const TrajectoryErrorOptions& options) {
  std::vector<PosePair> around;
  for (const TrajectoryInput& input : inputs) {
    const auto pairs = associate(input.truth, input.estimate, window_of(input), options.max_gap_s,
                                 options.max_difference_s);
    if (pairs.empty())
      throw std::invalid_argument(input.name + ": none of its " +
                                  std::to_string(input.estimate.size()) +
                                  " poses falls on the truth's time");
    for (const PosePair& pair : pairs)
      for (int axis = 0; axis < 3; ++axis)
        for (const double side_m : {-radius_m, radius_m}) {
          const Eigen::Vector3d point = side_m * Eigen::Vector3d::Unit(axis);
          PosePair& added = around.emplace_back();
          added.T_truth_body.translation() = pair.T_truth_body * point;
          added.T_estimate_body.translation() = pair.T_estimate_body * point;
        }
  }
  if (around.empty()) throw std::invalid_argument("align_surroundings: no trajectory");
  return align(around, false).T_truth_estimate;
}

}  // namespace km
