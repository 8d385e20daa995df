#include "apps/lab/simulation/motion/imu_simulator.hpp"

#include <cmath>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

// White noise and a bias with a random walk, for one of the two sensors. Kalibr's IMU noise model
// in discrete time: n[k] = density / sqrt(dt) w[k], b[k] = b[k-1] + walk * sqrt(dt) w[k].
class SensorError {
 public:
  SensorError(double initial, double density, double walk, double rate_hz, GaussianRandom random)
      : random_(random), noise_(density * std::sqrt(rate_hz)), walk_(walk / std::sqrt(rate_hz)) {
    bias_ = initial * random_.draw3();
  }

  [[nodiscard]] const Eigen::Vector3d& bias() const { return bias_; }
  [[nodiscard]] Eigen::Vector3d draw_noise() { return noise_ * random_.draw3(); }
  void walk() { bias_ += walk_ * random_.draw3(); }

 private:
  GaussianRandom random_;
  double noise_, walk_;
  Eigen::Vector3d bias_;
};

GaussianRandom stream(const ImuSimulation& options, std::uint64_t part) {
  return GaussianRandom(SeededRandom::stream(options.seed, part));
}

}  // namespace

std::vector<SimulatedImu> simulate_imu(const BodyTrajectory& trajectory, Stamp epoch,
                                       const ImuSimulation& options) {
  const ImuNoise& n = options.noise;
  const InertialErrors& errors = options.errors;
  SensorError gyro(options.initial_gyro_bias, n.gyro_noise_density, n.gyro_random_walk, n.rate_hz,
                   stream(options, 1));
  SensorError accel(options.initial_accel_bias, n.accel_noise_density, n.accel_random_walk,
                    n.rate_hz, stream(options, 2));
  const Eigen::Vector3d gravity(0.0, 0.0, -kGravity_mps2);

  std::vector<SimulatedImu> samples;
  for (std::int64_t k = std::llround(std::ceil(trajectory.start_s() * n.rate_hz));; ++k) {
    const Stamp since_epoch = std::llround(static_cast<double>(k) * 1e9 / n.rate_hz);
    const double t_s = seconds_between(0, since_epoch);
    if (t_s < trajectory.start_s()) continue;
    if (t_s > trajectory.end_s()) break;
    const BodyMotion motion = trajectory.motion(t_s);
    SimulatedImu simulated;
    simulated.sample.stamp = epoch + since_epoch;
    const double run_s = t_s - trajectory.start_s();
    const double warmth = errors.warmth(run_s);
    const Eigen::Vector3d sway = errors.sway(run_s);
    simulated.gyro_bias = gyro.bias() + warmth * errors.gyro_warm;
    simulated.accel_bias = accel.bias() + warmth * errors.accel_warm;
    simulated.sample.gyro = errors.gyro_matrix * motion.angular_velocity_body +
                            simulated.gyro_bias + gyro.draw_noise() + errors.gyro_vibration * sway;
    const Eigen::Vector3d force =
        motion.T_world_body.linear().transpose() * (motion.acceleration_world - gravity);
    simulated.sample.accel = errors.accel_matrix * force + simulated.accel_bias +
                             accel.draw_noise() + errors.accel_vibration * sway;
    samples.push_back(simulated);
    gyro.walk();
    accel.walk();
  }
  return samples;
}

}  // namespace km
