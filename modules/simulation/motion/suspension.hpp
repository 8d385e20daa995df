#pragma once

namespace km {

/// Heave, pitch and roll of a body on its springs.
struct SprungBody {
  double heave_m = 0.0;    ///< Height of the point midway between the wheels.
  double pitch_rad = 0.0;  ///< About the y axis (left): nose down is positive.
  double roll_rad = 0.0;   ///< About the x axis (forward): leaning right is positive.
};

/// Heave, pitch and roll, each two oscillators in a row: the wheels on their tyres follow the
/// ground u, the body on its springs follows the wheels w,
///   w'' = -2 zeta_t a w' - a^2 (w - u),
///   x'' = -2 zeta b (x' - w') - b^2 (x - w).
/// For pitch and roll u has, beside the ground's slope, what the vehicle's acceleration adds: nose
/// down under braking, leaning outwards in curves.
class Suspension {
 public:
  /// At rest on `ground`.
  explicit Suspension(const SprungBody& ground);

  /// The body after `dt_s` in which the ground moves evenly to `ground`, at the vehicle's
  /// acceleration forward and to the left [m/s^2]. Exactly at rest while nothing changes.
  SprungBody step(const SprungBody& ground, double forward_mps2, double left_mps2, double dt_s);

 private:
  class Axis {
   public:
    explicit Axis(double at_rest) : ground_(at_rest), wheels_(at_rest), body_(at_rest) {}
    double advance(double next_ground, double frequency_hz, double dt_s);

   private:
    double ground_, wheels_, body_;
    double wheels_rate_ = 0.0, body_rate_ = 0.0;
  };
  Axis heave_, pitch_, roll_;
};

}  // namespace km
