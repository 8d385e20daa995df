#pragma once

namespace km {

/// Heave, pitch and roll of a body on its springs.
struct SprungBody {
  double heave_m = 0.0;    ///< Height of the body's reference above where it is at rest on level 0.
  double pitch_rad = 0.0;  ///< About the y axis (left): nose down is positive.
  double roll_rad = 0.0;   ///< About the x axis (forward): leaning right is positive.
};

/// A damped oscillator each for heave, pitch and roll, excited by the ground under the wheels:
///   x'' = -2 zeta w (x' - u') - w^2 (x - u),
/// where u is the ground's, for pitch and roll plus what the vehicle's acceleration adds at rest:
/// nose down under braking, leaning outwards in curves.
class Suspension {
 public:
  explicit Suspension(const SprungBody& ground);

  /// The body after `dt_s` in which the ground moves evenly to `ground`, at the vehicle's
  /// acceleration forward and to the left [m/s^2].
  SprungBody step(const SprungBody& ground, double forward_mps2, double left_mps2, double dt_s);

 private:
  struct Oscillator {
    double value = 0.0, rate = 0.0, input = 0.0;
    double advance(double next_input, double frequency_hz, double dt_s);
  };
  Oscillator heave_, pitch_, roll_;
};

}  // namespace km
