#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/rendering/lanes.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {

/// Radiance of a sky with clouds, brighter towards the horizon and around the sun, tabulated. It is
/// scaled so that an unshaded roof receives Lighting::ambient from it. Below the horizon it has the
/// radiance of the horizon. Immutable.
class Sky {
 public:
  explicit Sky(const Lighting& lighting);

  /// `direction` need not have unit length.
  [[nodiscard]] float luminance(const Eigen::Vector3f& direction) const;
  /// Luminance for sixteen directions.
  [[nodiscard]] Lanes luminance(const Lanes3& directions) const;

  /// Mean radiance at the horizon: distant surfaces fade to it.
  [[nodiscard]] float haze_luminance() const { return haze_luminance_; }

 private:
  /// Position in the table: the upper hemisphere in stereographic projection.
  struct Cell {
    std::int32_t index = 0;
    float x = 0.0F, y = 0.0F;
  };
  [[nodiscard]] static Cell cell_of(float x, float y, float z);

  std::vector<float> luminance_;
  float haze_luminance_ = 0.0F;
};

}  // namespace km
