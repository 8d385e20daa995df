#pragma once

#include <cstdint>

namespace km {

/// Smooth noise in [-1, 1] with features of about `feature_m`. It depends only on its arguments.
[[nodiscard]] float ground_noise(float x, float y, float feature_m, std::uint64_t seed);

}  // namespace km
