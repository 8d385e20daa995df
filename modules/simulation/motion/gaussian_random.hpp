#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "modules/simulation/world/seeded_random.hpp"

namespace km {

/// Standard normal draws from SeededRandom by the method of Box and Muller (1958).
class GaussianRandom {
 public:
  explicit GaussianRandom(SeededRandom random) : random_(random) {}

  [[nodiscard]] double draw() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(1.0 - random_.unit()));
    const double angle = 2.0 * std::numbers::pi * random_.unit();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

  [[nodiscard]] Eigen::Vector3d draw3() {
    Eigen::Vector3d values;
    for (double& value : values) value = draw();
    return values;
  }

 private:
  SeededRandom random_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace km
