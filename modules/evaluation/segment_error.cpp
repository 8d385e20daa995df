#include "modules/evaluation/segment_error.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace km {
namespace {

constexpr std::size_t kLengths = 4;
constexpr double kMinLength_m = 0.01;
constexpr double kDegrees = 180.0 / std::numbers::pi;

SE3 scaled(SE3 T, double scale) {
  T.translation() *= scale;
  return T;
}

// True path from the first pair to each [m].
std::vector<double> distances(std::span<const PosePair> pairs) {
  std::vector<double> result(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i)
    result[i] =
        result[i - 1] +
        (pairs[i].T_truth_body.translation() - pairs[i - 1].T_truth_body.translation()).norm();
  return result;
}

}  // namespace

std::vector<double> segment_lengths(double path_m) {
  std::vector<double> lengths;
  for (double decade = kMinLength_m; decade <= 0.5 * path_m; decade *= 10.0)
    for (const double step : {1.0, 2.0, 5.0})
      if (step * decade <= 0.5 * path_m) lengths.push_back(step * decade);
  if (lengths.size() > kLengths)
    lengths.erase(lengths.begin(), lengths.end() - static_cast<std::ptrdiff_t>(kLengths));
  return lengths;
}

SegmentErrors segment_errors(std::span<const PosePair> pairs, std::span<const double> lengths_m,
                             double scale) {
  SegmentErrors errors;
  const std::vector<double> at_m = distances(pairs);
  for (const double length_m : lengths_m) {
    if (!(length_m > 0.0)) throw std::invalid_argument("segment_errors: a length is not positive");
    std::size_t j = 0;
    bool used = false;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      while (j < pairs.size() && at_m[j] - at_m[i] < length_m) ++j;
      if (j == pairs.size()) break;
      const double path_m = at_m[j] - at_m[i];
      const SE3 T_i_j = pairs[i].T_truth_body.inverse() * pairs[j].T_truth_body;
      const SE3 T_i_j_estimate =
          scaled(pairs[i].T_estimate_body.inverse() * pairs[j].T_estimate_body, scale);
      const SE3 error = T_i_j.inverse() * T_i_j_estimate;
      errors.translation_percent.push_back(100.0 * error.translation().norm() / path_m);
      errors.rotation_deg_per_m.push_back(kDegrees * angle_of(error.linear()) / path_m);
      used = true;
    }
    if (used) errors.lengths_m.push_back(length_m);
  }
  std::sort(errors.lengths_m.begin(), errors.lengths_m.end());
  return errors;
}

SegmentErrors segment_errors(std::span<const PosePair> pairs, double scale) {
  const std::vector<double> at_m = distances(pairs);
  return segment_errors(pairs, segment_lengths(at_m.empty() ? 0.0 : at_m.back()), scale);
}

}  // namespace km
