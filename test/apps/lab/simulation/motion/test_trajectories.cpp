#include <Eigen/Core>
#include <complex>

#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/motion/road.hpp"
#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/motion/vehicle_trajectory.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const Eigen::AlignedBox3d kRoom(Eigen::Vector3d(-3.0, -2.5, 0.2), Eigen::Vector3d(3.0, 2.5, 3.0));

TEST_CASE("A flight stays in its volume and is as lively as it should be") {
  FlightOptions options{.seed = GENERATE(1U, 2U, 3U, 4U)};
  CAPTURE(options.seed);
  options.duration_s = 100.0;
  const SplineTrajectory flight = make_flight_trajectory(kRoom, options);
  CHECK(flight.end_s() >= 100.0);
  CHECK(flight.end_s() < 100.05);
  double speed = 0.0, rate = 0.0, tilt = 0.0;
  for (double t = 0.0; t <= flight.end_s(); t += 0.01) {
    const BodyMotion m = flight.motion(t);
    const Eigen::Vector3d p = m.T_world_body.translation();
    REQUIRE(kRoom.exteriorDistance(p) < 1e-9);
    speed = std::max(speed, m.velocity_world.norm());
    rate = std::max(rate, m.angular_velocity_body.norm());
    tilt = std::max(tilt, std::acos(m.T_world_body.linear()(2, 2)));
  }
  CAPTURE(speed, rate, tilt);
  CHECK(speed > 0.5);
  CHECK(speed < 1.15);  // its own speed and that of the gusts
  CHECK(rate > 0.5);
  CHECK(rate < 1.047 + 0.6);
  CHECK(tilt > 0.05);
  CHECK(tilt < 0.4);
}

const Route kDriveRoute{{{0, 0}, {80, 0}, {80, 50}, {30, 50}, {30, 90}, {0, 90}}, 7.0};

double hills(double x, double y) {
  return 0.8 * std::sin(x / 12.0) + 0.5 * std::cos(y / 9.0);
}

double level(double /*x*/, double /*y*/) {
  return 0.0;
}

// Statistics of a drive, on the ground below the body.
struct DriveSummary {
  double forward_max = 0.0, left_max = 0.0;  // [m/s^2]
  double off_route_max = 0.0;                // [m], from the rounded path
  double heading_error_max = 0.0;            // [rad], between x and the velocity
  double pitch_max = 0.0, roll_max = 0.0;    // [rad]
  double speed_max = 0.0;
};

double distance_to_path(const RoutePath& path, const Eigen::Vector2d& point) {
  double best = std::numeric_limits<double>::infinity();
  for (double s = 0.0; s < path.length_m(); s += 0.1)
    best = std::min(best, (path.at(s).position - point).norm());
  return best;
}

DriveSummary summarise(const BodyTrajectory& drive, const Route& route) {
  const RoutePath path(route, 5.0);
  DriveSummary summary;
  constexpr double kSample_s = 0.02;
  for (double t = 0.0; t <= drive.end_s(); t += kSample_s) {
    const BodyMotion m = drive.motion(t);
    const Eigen::Matrix3d R = m.T_world_body.linear();
    const Eigen::Vector2d heading = R.col(0).head<2>().normalized();
    const Eigen::Vector2d left(-heading.y(), heading.x());
    const Eigen::Vector2d velocity = m.velocity_world.head<2>();
    const double speed = velocity.norm();
    summary.speed_max = std::max(summary.speed_max, speed);
    summary.forward_max =
        std::max(summary.forward_max, std::abs(m.acceleration_world.head<2>().dot(heading)));
    summary.left_max =
        std::max(summary.left_max, std::abs(m.acceleration_world.head<2>().dot(left)));
    summary.pitch_max = std::max(summary.pitch_max, std::abs(std::asin(R(2, 0))));
    summary.roll_max = std::max(summary.roll_max, std::abs(std::asin(R(2, 1))));
    if (speed > 1.0)
      summary.heading_error_max =
          std::max(summary.heading_error_max,
                   std::abs(std::atan2(velocity.dot(left), velocity.dot(heading))));
    summary.off_route_max = std::max(
        summary.off_route_max, distance_to_path(path, m.T_world_body.translation().head<2>()));
  }
  return summary;
}

TEST_CASE("A vehicle on level ground keeps to the limits and to its route") {
  VehicleOptions options{.seed = GENERATE(1U, 5U)};
  CAPTURE(options.seed);
  options.rig_height_m = 0.0;  // the point on the ground, for which the limits hold
  options.start_m = 25.0 * static_cast<double>(options.seed);
  const SplineTrajectory drive = make_vehicle_trajectory(kDriveRoute, level, options);
  CHECK(drive.end_s() == Approx(60.0).margin(0.05));
  const DriveSummary s = summarise(drive, kDriveRoute);
  CAPTURE(s.forward_max, s.left_max, s.off_route_max, s.heading_error_max, s.pitch_max, s.roll_max);
  CHECK(s.forward_max <= 1.5);
  CHECK(s.left_max <= 2.5);
  CHECK(s.left_max > 0.5 * 2.5);  // it uses the corners
  CHECK(s.speed_max <= kDriveRoute.speed_mps);
  CHECK(s.off_route_max < 0.35);      // wander of a driver
  CHECK(s.heading_error_max < 0.01);  // a wheel rolls without slip
  CHECK(s.pitch_max < 0.04);
  CHECK(s.roll_max < 0.05);
}

TEST_CASE("A vehicle follows the ground") {
  const VehicleOptions options;
  const SplineTrajectory drive = make_vehicle_trajectory(kDriveRoute, hills, options);
  for (double t = 0.0; t <= 60.0; t += 0.05) {
    const SE3 T = drive.motion(t).T_world_body;
    const Eigen::Vector3d ground = T * Eigen::Vector3d(0, 0, -options.rig_height_m);
    CAPTURE(t);
    CHECK(ground.z() == Approx(hills(ground.x(), ground.y())).margin(0.1));
    // Tilted like the slope below, up to the motion of the springs.
    const Eigen::Vector2d slope(0.8 / 12.0 * std::cos(ground.x() / 12.0),
                                -0.5 / 9.0 * std::sin(ground.y() / 9.0));
    const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
    CHECK(std::acos(std::min(1.0, T.linear().col(2).dot(normal))) < 0.06);
  }
}

constexpr Stamp kEpoch = 1403715273262142976;

// A flight, recorded.
struct Recording {
  SplineTrajectory truth;
  std::vector<StampedPose> poses;
};

Recording record(double rate_hz, double position_noise_m, double rotation_noise_rad) {
  FlightOptions options{.duration_s = 30.0};
  Recording recording{
      make_flight_trajectory({Eigen::Vector3d(-3, -3, 0), Eigen::Vector3d(3, 3, 3)}, options), {}};
  GaussianRandom random{SeededRandom(6)};
  for (int k = 0; k <= static_cast<int>(30.0 * rate_hz); ++k) {
    const Stamp since = std::llround(k * 1e9 / rate_hz);
    SE3 T = recording.truth.motion(std::min(30.0, 1e-9 * static_cast<double>(since))).T_world_body;
    T.translation() += position_noise_m * random.draw3();
    T.linear() = T.linear() * so3_exp(rotation_noise_rad * random.draw3());
    recording.poses.push_back({kEpoch + since, T});
  }
  return recording;
}

TEST_CASE("A fit to perfect poses is the motion they were taken from") {
  const double rate_hz = GENERATE(20.0, 200.0);
  CAPTURE(rate_hz);
  const Recording recording = record(rate_hz, 0.0, 0.0);
  const SplineTrajectory fitted = fit_recording(recording.poses, kEpoch);
  CHECK(fitted.start_s() == 0.0);
  CHECK(fitted.end_s() == Approx(30.0));
  for (double t = 0.2; t <= 29.8; t += 0.0173) {
    const BodyMotion truth = recording.truth.motion(t), found = fitted.motion(t);
    CHECK((truth.T_world_body.translation() - found.T_world_body.translation()).norm() < 5e-4);
    CHECK(angle_of(truth.T_world_body.linear().transpose() * found.T_world_body.linear()) < 1e-3);
    CHECK((truth.velocity_world - found.velocity_world).norm() < 5e-3);
    CHECK((truth.angular_velocity_body - found.angular_velocity_body).norm() < 2e-2);
  }
}

TEST_CASE("Outliers do not bend a fit") {
  Recording recording = record(200.0, 0.0002, 0.0002);
  for (std::size_t k = 500; k < recording.poses.size(); k += 700) {
    recording.poses[k].T.translation() += Eigen::Vector3d(0.3, -0.2, 0.1);
    recording.poses[k].T.linear() = recording.poses[k].T.linear() * so3_exp({0.0, 0.2, 0.1});
  }
  const SplineTrajectory fitted = fit_recording(recording.poses, kEpoch);
  for (double t = 0.5; t < 29.5; t += 0.01) {
    const SE3 error =
        recording.truth.motion(t).T_world_body.inverse() * fitted.motion(t).T_world_body;
    CHECK(error.translation().norm() < 2e-3);
    CHECK(angle_of(error.linear()) < 2e-3);
  }
}

// One-sided spectral density of the heights near `frequency` [cycles/m], averaged over windows.
double density_at(double frequency, double roughness) {
  constexpr double kWindow_m = 100.0, kStep_m = 0.05;
  constexpr int kWindows = 60;
  const RoadProfile profile(0.0, kWindows * kWindow_m, roughness, 3);
  double sum = 0.0;
  for (int w = 0; w < kWindows; ++w) {
    std::complex<double> transform = 0.0;
    for (double x = 0.0; x < kWindow_m; x += kStep_m) {
      // Hann's window; its mean square is 3/8.
      const double weight = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * x / kWindow_m);
      transform += weight * profile.height_m(w * kWindow_m + x) * kStep_m *
                   std::polar(1.0, -2.0 * std::numbers::pi * frequency * x);
    }
    sum += 2.0 * std::norm(transform) / (0.375 * kWindow_m);
  }
  return sum / kWindows;
}

TEST_CASE("A road of roughness 1 has the spectrum of ISO 8608 class A") {
  // 60 windows of an exponentially distributed estimate: 13 % standard deviation, checked to 4.
  for (const double frequency : {0.1, 0.2, 0.5, 1.0}) {
    CAPTURE(frequency);
    const double expected = 16e-6 * std::pow(frequency / 0.1, -2.0);
    CHECK(density_at(frequency, 1.0) == Approx(expected).epsilon(0.5));
  }
}

}  // namespace
}  // namespace km
