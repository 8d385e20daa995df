#pragma once

#include <vector>

namespace km {

/// What a lens makes of a sharp image: each pixel's light spread as a Gaussian of `sigma_px`; the
/// borders continue outwards. Row-major, width * height. Value: float, Eigen::Vector3f.
template <typename Value>
[[nodiscard]] std::vector<Value> lens_blurred(const std::vector<Value>& image, int width,
                                              int height, double sigma_px);

}  // namespace km
