#include "modules/simulation/motion/suspension.hpp"

#include <numbers>

namespace km {
namespace {

// A passenger car's: eigenfrequencies, damping, and how far it tilts per acceleration (about 4 and
// 5 degrees per g).
constexpr double kHeave_hz = 1.5;
constexpr double kPitch_hz = 1.6;
constexpr double kRoll_hz = 1.4;
constexpr double kDamping = 0.3;
constexpr double kWheelHop_hz = 10.0;
constexpr double kWheelDamping = 0.5;
constexpr double kPitchGain = -0.007;  // [rad/(m/s^2)]: speeding up lifts the nose
constexpr double kRollGain = 0.009;    // [rad/(m/s^2)]
constexpr int kSubsteps = 5;

constexpr double angular(double frequency_hz) {
  return 2.0 * std::numbers::pi * frequency_hz;
}

}  // namespace

Suspension::Suspension(const SprungBody& ground)
    : heave_(ground.heave_m), pitch_(ground.pitch_rad), roll_(ground.roll_rad) {}

// Semi-implicit Euler: stable for steps far below the periods.
double Suspension::Axis::advance(double next_ground, double frequency_hz, double dt_s) {
  const double a = angular(kWheelHop_hz), b = angular(frequency_hz);
  const double h = dt_s / kSubsteps;
  const double ground_step = (next_ground - ground_) / kSubsteps;
  for (int k = 0; k < kSubsteps; ++k) {
    ground_ = k + 1 == kSubsteps ? next_ground : ground_ + ground_step;
    wheels_rate_ += h * (a * a * (ground_ - wheels_) - 2.0 * kWheelDamping * a * wheels_rate_);
    wheels_ += h * wheels_rate_;
    body_rate_ +=
        h * (b * b * (wheels_ - body_) - 2.0 * kDamping * b * (body_rate_ - wheels_rate_));
    body_ += h * body_rate_;
  }
  return body_;
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
