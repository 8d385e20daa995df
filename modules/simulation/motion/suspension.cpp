#include "modules/simulation/motion/suspension.hpp"

#include <numbers>

namespace km {
namespace {

// A passenger car's: eigenfrequencies of the body, damping, and how far it tilts per acceleration
// (about 4 and 5 degrees per g).
constexpr double kHeave_hz = 1.5;
constexpr double kPitch_hz = 1.6;
constexpr double kRoll_hz = 1.4;
constexpr double kDamping = 0.4;
constexpr double kPitchGain = -0.007;  // [rad/(m/s^2)]: speeding up lifts the nose
constexpr double kRollGain = 0.009;    // [rad/(m/s^2)]
constexpr int kSubsteps = 5;

}  // namespace

Suspension::Suspension(const SprungBody& ground)
    : heave_{ground.heave_m, 0.0, ground.heave_m},
      pitch_{ground.pitch_rad, 0.0, ground.pitch_rad},
      roll_{ground.roll_rad, 0.0, ground.roll_rad} {}

// Semi-implicit Euler: stable for steps far below the period, and exactly at rest when at rest.
double Suspension::Oscillator::advance(double next_input, double frequency_hz, double dt_s) {
  const double w = 2.0 * std::numbers::pi * frequency_hz;
  const double h = dt_s / kSubsteps;
  const double input_rate = (next_input - input) / dt_s;
  for (int k = 1; k <= kSubsteps; ++k) {
    const double u = k == kSubsteps ? next_input : input + k * h * input_rate;
    rate += h * (w * w * (u - value) - 2.0 * kDamping * w * (rate - input_rate));
    value += h * rate;
  }
  input = next_input;
  return value;
}

SprungBody Suspension::step(const SprungBody& ground, double forward_mps2, double left_mps2,
                            double dt_s) {
  SprungBody body;
  body.heave_m = heave_.advance(ground.heave_m, kHeave_hz, dt_s);
  body.pitch_rad = pitch_.advance(ground.pitch_rad + kPitchGain * forward_mps2, kPitch_hz, dt_s);
  body.roll_rad = roll_.advance(ground.roll_rad + kRollGain * left_mps2, kRoll_hz, dt_s);
  return body;
}

}  // namespace km
