#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "modules/core/data/keyframe.hpp"

namespace km {

/// Median depth of the keypoints whose depth is known, in the left camera [m]; nullopt if there are
/// none.
[[nodiscard]] inline std::optional<double> median_depth_m(const KeyframeFeatures& features) {
  std::vector<float> inverse_depths;
  for (const Keypoint& keypoint : features.keypoints)
    if (keypoint.has_depth()) inverse_depths.push_back(keypoint.inverse_depth);
  if (inverse_depths.empty()) return std::nullopt;
  const auto middle =
      inverse_depths.begin() + static_cast<std::ptrdiff_t>((inverse_depths.size() - 1) / 2);
  std::nth_element(inverse_depths.begin(), middle, inverse_depths.end());
  return 1.0 / static_cast<double>(*middle);
}

}  // namespace km
