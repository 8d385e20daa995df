#pragma once

#include <cstdint>

#include "modules/simulation/motion/uniform_spline.hpp"

namespace km {

/// Unevenness of the road under one wheel track by the way along it, frozen in space.
class RoadProfile {
 public:
  /// Covers ways from `begin_m` to `end_m`. `roughness` scales heights; 1 is a street of ISO 8608
  /// class A: its displacement has the one-sided density 16e-6 m^3 at 0.1 cycles per metre, falling
  /// with the square of the frequency. Below one cycle in about 100 m it is flat (the world's own
  /// ground takes over), above one in about 0.3 m a tyre bridges it.
  RoadProfile(double begin_m, double end_m, double roughness, std::uint64_t seed);

  [[nodiscard]] double height_m(double way_m) const { return curve_.at(way_m).value[0]; }

 private:
  UniformSpline<1> curve_;
};

}  // namespace km
