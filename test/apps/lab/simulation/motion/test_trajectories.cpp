#include <Eigen/Core>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/motion/road.hpp"
#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/motion/vehicle_trajectory.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "modules/core/lie.hpp"

namespace km {
namespace {

using Control = SplineTrajectory::Control;

/// Largest differences between the derivatives a trajectory states and central differences of its
/// poses and velocities.
struct DerivativeErrors {
  double velocity = 0.0;          ///< [m/s]
  double acceleration = 0.0;      ///< [m/s^2]
  double angular_velocity = 0.0;  ///< [rad/s]
};

DerivativeErrors derivative_errors(const BodyTrajectory& trajectory, int samples, double h_s) {
  std::mt19937_64 engine(5);
  DerivativeErrors worst;
  const double span = trajectory.end_s() - trajectory.start_s() - 2.0 * h_s;
  for (int k = 0; k < samples; ++k) {
    const double unit = static_cast<double>(engine() >> 11) * 0x1.0p-53;
    const double t = trajectory.start_s() + h_s + span * unit;
    const BodyMotion now = trajectory.motion(t);
    const BodyMotion before = trajectory.motion(t - h_s);
    const BodyMotion after = trajectory.motion(t + h_s);
    const Eigen::Vector3d velocity =
        (after.T_world_body.translation() - before.T_world_body.translation()) / (2.0 * h_s);
    const Eigen::Vector3d acceleration =
        (after.velocity_world - before.velocity_world) / (2.0 * h_s);
    const Eigen::Matrix3d R_now_T = now.T_world_body.linear().transpose();
    const Eigen::Vector3d rate = (so3_log(R_now_T * after.T_world_body.linear()) -
                                  so3_log(R_now_T * before.T_world_body.linear())) /
                                 (2.0 * h_s);
    worst.velocity = std::max(worst.velocity, (velocity - now.velocity_world).norm());
    worst.acceleration =
        std::max(worst.acceleration, (acceleration - now.acceleration_world).norm());
    worst.angular_velocity =
        std::max(worst.angular_velocity, (rate - now.angular_velocity_body).norm());
  }
  return worst;
}

/// Checks that the body does not move from `from_s` to `to_s`.
void check_at_rest(const BodyTrajectory& trajectory, double from_s, double to_s) {
  const SE3 T_start = trajectory.motion(from_s).T_world_body;
  constexpr double kRounding =
      1e-9;  // rounding of second derivatives: 1e-16 over the interval squared
  for (double t = from_s; t <= to_s; t += 0.01) {
    const BodyMotion motion = trajectory.motion(t);
    CAPTURE(t);
    CHECK(motion.T_world_body.isApprox(T_start, 1e-12));
    CHECK(motion.velocity_world.norm() < kRounding);
    CHECK(motion.acceleration_world.norm() < kRounding);
    CHECK(motion.angular_velocity_body.norm() < kRounding);
  }
}

// A lively motion: steps of about 0.2 m and 12 degrees between controls.
std::vector<Control> lively_controls(std::uint64_t seed, int count) {
  GaussianRandom random{SeededRandom(seed)};
  SE3 T = SE3::Identity();
  std::vector<Control> controls;
  for (int k = 0; k < count; ++k) {
    Vector6 step;
    step << 0.12 * random.draw3(), 0.12 * random.draw3();
    T = T * se3_exp(step);
    controls.push_back(spline_control(T));
  }
  return controls;
}

TEST_CASE("The weights of the basis sum to one and their derivatives to zero", "[motion]") {
  for (double u = 0.0; u <= 1.0; u += 0.125) {
    const QuinticBasis basis = QuinticBasis::at(u);
    CAPTURE(u);
    CHECK(basis.value.sum() == Approx(1.0).epsilon(1e-14));
    CHECK(std::abs(basis.first.sum()) < 1e-14);
    CHECK(std::abs(basis.second.sum()) < 1e-14);
    CHECK(basis.value.minCoeff() > -1e-15);
  }
}

TEST_CASE("The basis joins with four continuous derivatives", "[motion]") {
  // Each weight at the end of an interval is that of the control before at the start of the next.
  const QuinticBasis end = QuinticBasis::at(1.0);
  const QuinticBasis start = QuinticBasis::at(0.0);
  for (int k = 1; k < 6; ++k) {
    CHECK(end.value[k] == Approx(start.value[k - 1]).margin(1e-15));
    CHECK(end.first[k] == Approx(start.first[k - 1]).margin(1e-15));
    CHECK(end.second[k] == Approx(start.second[k - 1]).margin(1e-15));
  }
  CHECK(end.value[0] == Approx(0.0).margin(1e-15));
  // The known values of the quintic B-spline at its knots.
  CHECK(start.value[2] == Approx(66.0 / 120.0));
  CHECK(start.value[1] == Approx(26.0 / 120.0));
  CHECK(start.value[0] == Approx(1.0 / 120.0));
}

TEST_CASE("A spline states the derivatives of its own poses", "[motion]") {
  const std::uint64_t seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const SplineTrajectory trajectory(3.0, 0.2, lively_controls(seed, 60));
  // Central differences err by h^2 / 6 times the third derivative, here below 1e3 units: 2e-6.
  const DerivativeErrors errors = derivative_errors(trajectory, 400, 1e-4);
  CHECK(errors.velocity < 2e-6);
  CHECK(errors.acceleration < 2e-5);
  CHECK(errors.angular_velocity < 2e-6);
}

TEST_CASE("A spline is four times continuously differentiable across its intervals", "[motion]") {
  const SplineTrajectory trajectory(0.0, 0.2, lively_controls(7, 30));
  constexpr double kEpsilon = 1e-9;
  for (int k = 1; k < 24; ++k) {
    const BodyMotion before = trajectory.motion(0.2 * k - kEpsilon);
    const BodyMotion after = trajectory.motion(0.2 * k + kEpsilon);
    CHECK((before.acceleration_world - after.acceleration_world).norm() < 1e-5);
    CHECK((before.angular_velocity_body - after.angular_velocity_body).norm() < 1e-6);
  }
}

TEST_CASE("A rotation of the world rotates the curve in the same way", "[motion]") {
  const std::vector<Control> controls = lively_controls(4, 20);
  const Eigen::Quaterniond turn(so3_exp({0.4, -1.1, 2.0}));
  std::vector<Control> turned;
  for (const Control& control : controls) {
    Control moved;
    moved << turn * control.head<3>(),
        (turn * Eigen::Quaterniond(control.tail<4>().eval())).coeffs();
    turned.push_back(moved);
  }
  const SplineTrajectory a(0.0, 0.1, controls), b(0.0, 0.1, turned);
  for (double t = 0.0; t <= 1.5; t += 0.037) {
    const BodyMotion m = a.motion(t), n = b.motion(t);
    CHECK((turn * m.T_world_body.linear() - n.T_world_body.linear()).norm() < 1e-12);
    CHECK((m.angular_velocity_body - n.angular_velocity_body).norm() < 1e-11);
    CHECK((turn * m.acceleration_world - n.acceleration_world).norm() < 1e-10);
  }
}

TEST_CASE("The sign of a control's quaternion does not matter", "[motion]") {
  const std::vector<Control> controls = lively_controls(5, 20);
  std::vector<Control> flipped = controls;
  for (std::size_t k = 0; k < flipped.size(); k += 3)
    flipped[k].tail<4>() = -flipped[k].tail<4>().eval();
  const SplineTrajectory a(0.0, 0.1, controls), b(0.0, 0.1, flipped);
  for (double t = 0.0; t <= 1.5; t += 0.04)
    CHECK(a.motion(t).T_world_body.isApprox(b.motion(t).T_world_body, 1e-12));
}

TEST_CASE("Even motion along a line and about an axis is reproduced", "[motion]") {
  // Controls on a line give the line. About an axis the rate is even up to the square of the step.
  const Eigen::Vector3d velocity(1.0, -0.5, 0.25), rate(0.1, 0.2, -0.3);
  std::vector<SE3> poses;
  for (int k = -2; k < 105; ++k)
    poses.push_back(make_pose(so3_exp(rate * 0.01 * k), velocity * 0.01 * k));
  const SplineTrajectory trajectory = spline_along(0.0, 0.01, poses);
  for (double t = 0.1; t < 0.9; t += 0.03) {
    const BodyMotion motion = trajectory.motion(t);
    CHECK((motion.T_world_body.translation() - velocity * t).norm() < 1e-12);
    CHECK((motion.velocity_world - velocity).norm() < 1e-11);
    CHECK(motion.acceleration_world.norm() < 1e-9);
    CHECK((motion.angular_velocity_body - rate).norm() < 1e-6);
    CHECK(so3_log(so3_exp(rate * t).transpose() * motion.T_world_body.linear()).norm() < 1e-8);
  }
}

TEST_CASE("Equal controls are a body at rest", "[motion]") {
  const SE3 T = make_pose(so3_exp({0.3, 0.2, -1.0}), {100.0, -50.0, 3.0});
  const SplineTrajectory trajectory = spline_along(1.0, 0.1, std::vector<SE3>(15, T));
  CHECK(trajectory.start_s() == 1.0);
  CHECK(trajectory.end_s() == Approx(2.0));
  check_at_rest(trajectory, 1.0, 2.0);
}

TEST_CASE("A spline refuses controls that are no motion", "[motion]") {
  const std::vector<Control> good = lively_controls(1, 10);
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.1, lively_controls(1, 5)), std::invalid_argument);
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.0, good), std::invalid_argument);
  CHECK_THROWS_AS(SplineTrajectory(0.0, -0.1, good), std::invalid_argument);
  CHECK_THROWS_AS(SplineTrajectory(std::numeric_limits<double>::quiet_NaN(), 0.1, good),
                  std::invalid_argument);
  std::vector<Control> bad = good;
  bad[4][1] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.1, bad), std::invalid_argument);
  bad = good;
  bad[4].tail<4>().setZero();
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.1, bad), std::invalid_argument);
  bad = std::vector<Control>(10, spline_control(SE3::Identity()));
  bad[5] = spline_control(make_pose(so3_exp({0.0, 0.0, 1.6}), {0.0, 0.0, 0.0}));  // 92 degrees
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.1, bad), std::invalid_argument);
  CHECK_THROWS_AS(spline_along(0.0, 0.1, std::vector<SE3>{}), std::invalid_argument);

  const SplineTrajectory trajectory(0.0, 0.1, good);
  CHECK_THROWS_AS(trajectory.motion(-0.001), std::out_of_range);
  CHECK_THROWS_AS(trajectory.motion(trajectory.end_s() + 0.001), std::out_of_range);
  CHECK_NOTHROW(trajectory.motion(trajectory.end_s()));
}

const Eigen::AlignedBox3d kRoom(Eigen::Vector3d(-3.0, -2.5, 0.2), Eigen::Vector3d(3.0, 2.5, 3.0));

TEST_CASE("A flight stays in its volume and is as lively as it should be", "[motion]") {
  FlightOptions options;
  options.seed = GENERATE(1U, 2U, 3U, 4U);
  CAPTURE(options.seed);
  options.duration_s = 100.0;
  const SplineTrajectory flight = make_flight_trajectory(kRoom, options);
  CHECK(flight.end_s() >= 100.0);
  CHECK(flight.end_s() < 100.05);
  double speed = 0.0, rate = 0.0, tilt = 0.0, length = 0.0, lowest = 10.0, highest = 0.0;
  for (double t = 0.0; t <= flight.end_s(); t += 0.01) {
    const BodyMotion m = flight.motion(t);
    const Eigen::Vector3d p = m.T_world_body.translation();
    REQUIRE(kRoom.exteriorDistance(p) < 1e-9);
    speed = std::max(speed, m.velocity_world.norm());
    length += m.velocity_world.norm() * 0.01;
    rate = std::max(rate, m.angular_velocity_body.norm());
    tilt = std::max(tilt, std::acos(m.T_world_body.linear()(2, 2)));
    if (t > 10.0) lowest = std::min(lowest, p.z());
    highest = std::max(highest, p.z());
  }
  CAPTURE(speed, rate, tilt, length, lowest, highest);
  CHECK(speed > 0.5);
  CHECK(speed < 1.15);  // its own speed and that of the gusts
  CHECK(rate > 0.5);
  CHECK(rate < 1.047 + 0.6);
  CHECK(tilt > 0.05);
  CHECK(tilt < 0.4);
  CHECK(length > 30.0);
  CHECK(highest - lowest > 1.0);
}

TEST_CASE("A flight begins at rest on the floor", "[motion]") {
  FlightOptions options;
  options.duration_s = 10.0;
  options.standstill_s = GENERATE(0.0, 2.0, 4.0);
  const SplineTrajectory flight = make_flight_trajectory(kRoom, options);
  CHECK(flight.motion(0.0).T_world_body.translation().z() == Approx(0.2));
  CHECK(flight.motion(0.0).T_world_body.linear()(2, 2) == Approx(1.0));
  check_at_rest(flight, 0.0, options.standstill_s - 0.05);
  CHECK(flight.motion(options.standstill_s + 4.0).T_world_body.translation().z() > 0.4);
}

TEST_CASE("A flight's thrust is along the vehicle's z axis", "[motion]") {
  FlightOptions options;
  const SplineTrajectory flight = make_flight_trajectory(kRoom, options);
  for (double t = 0.0; t <= flight.end_s(); t += 0.05) {
    const BodyMotion m = flight.motion(t);
    // Acceleration without gravity and without the drag of the rotors.
    const Eigen::Vector3d thrust =
        m.acceleration_world + 0.3 * m.velocity_world + Eigen::Vector3d(0, 0, 9.81);
    // The spline through poses every 10 ms smooths both a little: less than 3 mrad.
    CHECK(std::acos(std::min(1.0, thrust.normalized().dot(m.T_world_body.linear().col(2)))) < 3e-3);
  }
}

TEST_CASE("The body is mounted in the vehicle as the options state", "[motion]") {
  FlightOptions options;
  options.duration_s = 20.0;
  const SplineTrajectory vehicle = make_flight_trajectory(kRoom, options);
  options.R_vehicle_body = vehicle_from_body(RigKind::kFlying);
  const SplineTrajectory body = make_flight_trajectory(kRoom, options);
  for (double t = 0.0; t <= 20.0; t += 0.5)
    CHECK(body.motion(t).T_world_body.linear().isApprox(
        vehicle.motion(t).T_world_body.linear() * options.R_vehicle_body, 1e-9));
  // EuRoC's body has x up.
  CHECK(body.motion(0.0).T_world_body.linear()(2, 0) == Approx(1.0));
}

TEST_CASE("A flight states the derivatives of its own poses", "[motion]") {
  const SplineTrajectory flight = make_flight_trajectory(kRoom, {});
  // Errors of h^2 / 6 times third derivatives of less than 100 units, and rounding of 1e-15 / h.
  const DerivativeErrors errors = derivative_errors(flight, 500, 1e-4);
  CHECK(errors.velocity < 1e-6);
  CHECK(errors.acceleration < 1e-4);
  CHECK(errors.angular_velocity < 1e-6);
}

TEST_CASE("A flight refuses volumes and options without sense", "[motion]") {
  CHECK_THROWS_AS(make_flight_trajectory(Eigen::AlignedBox3d(), {}), std::invalid_argument);
  const Eigen::AlignedBox3d flat(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5, 5, 0.5));
  CHECK_THROWS_AS(make_flight_trajectory(flat, {}), std::invalid_argument);
  const auto refused = [](auto change) {
    FlightOptions options;
    change(options);
    CHECK_THROWS_AS(make_flight_trajectory(kRoom, options), ConfigError);
  };
  refused([](FlightOptions& o) { o.duration_s = -1.0; });
  refused([](FlightOptions& o) { o.standstill_s = std::nan(""); });
  refused([](FlightOptions& o) { o.max_speed_mps = 0.0; });
  refused([](FlightOptions& o) { o.max_yaw_rate = -1.0; });
  refused([](FlightOptions& o) { o.gusts_m = 1.0; });
  FlightOptions turned;
  turned.R_vehicle_body.setZero();
  CHECK_THROWS_AS(make_flight_trajectory(kRoom, turned), std::invalid_argument);
}

const Route kDriveRoute{{{0, 0}, {80, 0}, {80, 50}, {30, 50}, {30, 90}, {0, 90}}, 7.0};

double hills(double x, double y) {
  return 0.8 * std::sin(x / 12.0) + 0.5 * std::cos(y / 9.0);
}

// Statistics of a drive, on the ground below the body.
struct DriveSummary {
  double forward_max = 0.0, left_max = 0.0;  // [m/s^2]
  double off_route_max = 0.0;                // [m], from the rounded path
  double heading_error_max = 0.0;            // [rad], between x and the velocity
  double pitch_max = 0.0, roll_max = 0.0;    // [rad]
  double speed_max = 0.0, length_m = 0.0;
  int stops = 0;  // times it came to rest after having driven
};

double distance_to_path(const RoutePath& path, const Eigen::Vector2d& point) {
  double best = std::numeric_limits<double>::infinity();
  for (double s = 0.0; s < path.length_m(); s += 0.1)
    best = std::min(best, (path.at(s).position - point).norm());
  return best;
}

DriveSummary summarise(const BodyTrajectory& drive, const Route& route) {
  const RoutePath path(route, VehicleOptions{}.corner_radius_m);
  DriveSummary summary;
  constexpr double kSample_s = 0.02;
  bool moving = false;
  for (double t = 0.0; t <= drive.end_s(); t += kSample_s) {
    const BodyMotion m = drive.motion(t);
    const Eigen::Matrix3d R = m.T_world_body.linear();
    const Eigen::Vector2d heading = R.col(0).head<2>().normalized();
    const Eigen::Vector2d left(-heading.y(), heading.x());
    const Eigen::Vector2d velocity = m.velocity_world.head<2>();
    const double speed = velocity.norm();
    summary.length_m += speed * kSample_s;
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
    if (moving && speed < 0.02) ++summary.stops;
    moving = speed > (moving ? 0.02 : 0.5);
  }
  return summary;
}

TEST_CASE("A vehicle on level ground keeps to the limits and to its route", "[motion]") {
  VehicleOptions options;
  options.seed = GENERATE(1U, 2U, 3U, 4U, 5U);
  CAPTURE(options.seed);
  options.rig_height_m = 0.0;  // the point on the ground, for which the limits hold
  options.start_m = 25.0 * static_cast<double>(options.seed);
  const SplineTrajectory drive = make_vehicle_trajectory(kDriveRoute, nullptr, options);
  CHECK(drive.start_s() == 0.0);
  CHECK(drive.end_s() >= 60.0);
  CHECK(drive.end_s() < 60.05);
  const DriveSummary s = summarise(drive, kDriveRoute);
  CAPTURE(s.forward_max, s.left_max, s.off_route_max, s.heading_error_max, s.pitch_max, s.roll_max);
  CHECK(s.forward_max <= options.max_longitudinal_mps2);
  CHECK(s.left_max <= options.max_lateral_mps2);
  CHECK(s.left_max > 0.5 * options.max_lateral_mps2);  // it uses the corners
  CHECK(s.speed_max <= kDriveRoute.speed_mps);
  CHECK(s.off_route_max < 0.35);      // wander of a driver
  CHECK(s.heading_error_max < 0.01);  // a wheel rolls without slip
  CHECK(s.pitch_max < 0.04);
  CHECK(s.roll_max < 0.05);
  CHECK(s.pitch_max > 0.003);
  CHECK(s.roll_max > 0.005);
  CHECK(s.length_m > 150.0);
  CHECK(s.stops >= 1);
}

TEST_CASE("A vehicle stands still at the start for as long as the options state", "[motion]") {
  VehicleOptions options;
  options.standstill_s = GENERATE(0.5, 2.0);
  options.duration_s = 10.0;
  const SplineTrajectory drive = make_vehicle_trajectory(kDriveRoute, hills, options);
  check_at_rest(drive, 0.0, options.standstill_s);
  CHECK(drive.motion(options.standstill_s + 3.0).velocity_world.norm() > 0.3);
}

TEST_CASE("A vehicle follows the ground", "[motion]") {
  VehicleOptions options;
  options.roughness = 0.0;
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

TEST_CASE("A braking vehicle dips its nose, in a left turn it leans to the right", "[motion]") {
  VehicleOptions options;
  options.roughness = 0.0;
  const SplineTrajectory drive = make_vehicle_trajectory(kDriveRoute, nullptr, options);
  double pitch = 0.0, roll = 0.0;  // sums of products: they correlate
  for (double t = 2.0; t <= 60.0; t += 0.02) {
    const BodyMotion m = drive.motion(t);
    const Eigen::Matrix3d R = m.T_world_body.linear();
    pitch += m.acceleration_world.dot(R.col(0)) * R(2, 0);  // forward and nose up
    roll += m.acceleration_world.dot(R.col(1)) * R(2, 1);   // to the left and left side up
  }
  CHECK(pitch > 0.0);
  CHECK(roll > 0.0);
}

TEST_CASE("A drive states the derivatives of its own poses", "[motion]") {
  VehicleOptions options;
  options.duration_s = 30.0;
  const SplineTrajectory drive = make_vehicle_trajectory(kDriveRoute, hills, options);
  // h^2 / 6 times third derivatives below 1e3 m/s^3, and rounding of 1e-14 m / h.
  const DerivativeErrors errors = derivative_errors(drive, 500, 1e-4);
  CHECK(errors.velocity < 1e-5);
  CHECK(errors.acceleration < 1e-3);
  CHECK(errors.angular_velocity < 1e-5);
}

TEST_CASE("The road shakes a vehicle as a street shakes a car", "[motion]") {
  VehicleOptions options;
  options.stop_every_m = 0.0;
  options.standstill_s = 0.0;
  const auto vertical_rms = [&](double roughness) {
    options.roughness = roughness;
    const SplineTrajectory drive = make_vehicle_trajectory(kDriveRoute, nullptr, options);
    double sum = 0.0;
    int count = 0;
    for (double t = 5.0; t < 60.0; t += 0.01, ++count) {
      const double a = drive.motion(t).acceleration_world.z();
      sum += a * a;
    }
    return std::sqrt(sum / count);
  };
  const double smooth = vertical_rms(0.0), street = vertical_rms(2.0);
  CAPTURE(smooth, street);
  CHECK(smooth < 0.05);
  CHECK(street > 0.1);
  CHECK(street < 0.8);  // [m/s^2]; a car on a good street: some tenths
}

TEST_CASE("Equal options give equal flights and drives, another seed others", "[motion]") {
  const auto check = [](auto options, const auto& make) {
    options.duration_s = 20.0;
    const SplineTrajectory a = make(options), b = make(options);
    options.seed = 2;
    const SplineTrajectory c = make(options);
    for (double t = 0.0; t <= 20.0; t += 0.5)
      CHECK(a.motion(t).T_world_body.matrix() == b.motion(t).T_world_body.matrix());
    CHECK_FALSE(a.motion(15.0).T_world_body.isApprox(c.motion(15.0).T_world_body, 1e-3));
  };
  check(FlightOptions{}, [](const FlightOptions& o) { return make_flight_trajectory(kRoom, o); });
  check(VehicleOptions{},
        [](const VehicleOptions& o) { return make_vehicle_trajectory(kDriveRoute, hills, o); });
}

TEST_CASE("A vehicle starts at the configured distance along the route", "[motion]") {
  VehicleOptions options;
  options.duration_s = 3.0;
  const RoutePath path(kDriveRoute, options.corner_radius_m);
  for (const double start : {0.0, 30.0, 130.0, path.length_m() + 10.0}) {
    options.start_m = start;
    const SplineTrajectory drive = make_vehicle_trajectory(kDriveRoute, nullptr, options);
    const Eigen::Vector3d p = drive.motion(0.0).T_world_body.translation();
    CHECK((p.head<2>() - path.at(start).position).norm() < 0.3);
    CHECK(p.z() == Approx(1.5).margin(0.03));
  }
}

TEST_CASE("A vehicle refuses options that cannot be driven", "[motion]") {
  const auto refused = [](auto change) {
    VehicleOptions options;
    change(options);
    CHECK_THROWS_AS(make_vehicle_trajectory(kDriveRoute, nullptr, options), ConfigError);
  };
  refused([](VehicleOptions& o) { o.duration_s = 0.0; });
  refused([](VehicleOptions& o) { o.duration_s = std::nan(""); });
  refused([](VehicleOptions& o) { o.start_m = -1.0; });
  refused([](VehicleOptions& o) { o.standstill_s = -1.0; });
  refused([](VehicleOptions& o) { o.corner_radius_m = 0.0; });
  refused([](VehicleOptions& o) { o.max_lateral_mps2 = 0.0; });
  refused([](VehicleOptions& o) { o.max_longitudinal_mps2 = -1.0; });
  refused([](VehicleOptions& o) { o.roughness = -1.0; });
  Route still = kDriveRoute;
  still.speed_mps = 0.0;
  CHECK_THROWS_AS(make_vehicle_trajectory(still, nullptr, {}), std::invalid_argument);
}

}  // namespace
}  // namespace km
