#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "modules/core/lie.hpp"
#include "modules/simulation/motion/route_path.hpp"
#include "modules/simulation/motion/vehicle_trajectory.hpp"
#include "test/modules/simulation/motion/motion_checks.hpp"

namespace km {
namespace {

const Route kBlock{{{0, 0}, {80, 0}, {80, 50}, {30, 50}, {30, 90}, {0, 90}}, 7.0};

double hills(double x, double y) {
  return 0.8 * std::sin(x / 12.0) + 0.5 * std::cos(y / 9.0);
}

// What a drive amounts to, on the ground below the body.
struct DriveSummary {
  double forward_max = 0.0, left_max = 0.0;  // [m/s^2]
  double off_route_max = 0.0;                // [m], from the rounded path
  double heading_error_max = 0.0;            // [rad], of x from the velocity
  double pitch_max = 0.0, roll_max = 0.0;    // [rad]
  double speed_max = 0.0, length_m = 0.0;
  int stops = 0;  // times it came to rest after having driven
};

double distance_to(const RoutePath& path, const Eigen::Vector2d& point) {
  double best = std::numeric_limits<double>::infinity();
  for (double s = 0.0; s < path.length_m(); s += 0.1)
    best = std::min(best, (path.at(s).position - point).norm());
  return best;
}

DriveSummary summarise(const BodyTrajectory& drive, const Route& route) {
  const RoutePath path(route, VehicleOptions{}.corner_radius_m);
  DriveSummary summary;
  constexpr double kStep_s = 0.02;
  bool moving = false;
  for (double t = 0.0; t <= drive.end_s(); t += kStep_s) {
    const BodyMotion m = drive.motion(t);
    const Eigen::Matrix3d R = m.T_world_body.linear();
    const Eigen::Vector2d heading = R.col(0).head<2>().normalized();
    const Eigen::Vector2d left(-heading.y(), heading.x());
    const Eigen::Vector2d velocity = m.velocity_world.head<2>();
    const double speed = velocity.norm();
    summary.length_m += speed * kStep_s;
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
    summary.off_route_max =
        std::max(summary.off_route_max, distance_to(path, m.T_world_body.translation().head<2>()));
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
  const SplineTrajectory drive = make_vehicle_trajectory(kBlock, nullptr, options);
  CHECK(drive.start_s() == 0.0);
  CHECK(drive.end_s() >= 60.0);
  CHECK(drive.end_s() < 60.05);
  const DriveSummary s = summarise(drive, kBlock);
  CAPTURE(s.forward_max, s.left_max, s.off_route_max, s.heading_error_max, s.pitch_max, s.roll_max);
  CHECK(s.forward_max <= options.max_longitudinal_mps2);
  CHECK(s.left_max <= options.max_lateral_mps2);
  CHECK(s.left_max > 0.5 * options.max_lateral_mps2);  // it does use its corners
  CHECK(s.speed_max <= kBlock.speed_mps);
  CHECK(s.off_route_max < 0.35);      // what a driver wanders
  CHECK(s.heading_error_max < 0.01);  // a wheel rolls, it does not slip
  CHECK(s.pitch_max < 0.04);
  CHECK(s.roll_max < 0.05);
  CHECK(s.pitch_max > 0.003);
  CHECK(s.roll_max > 0.005);
  CHECK(s.length_m > 150.0);
  CHECK(s.stops >= 1);
}

TEST_CASE("A vehicle stands still at the start for as long as it is told", "[motion]") {
  VehicleOptions options;
  options.standstill_s = GENERATE(0.5, 2.0);
  options.duration_s = 10.0;
  const SplineTrajectory drive = make_vehicle_trajectory(kBlock, hills, options);
  check_at_rest(drive, 0.0, options.standstill_s);
  CHECK(drive.motion(options.standstill_s + 3.0).velocity_world.norm() > 0.3);
}

TEST_CASE("A vehicle follows the ground", "[motion]") {
  VehicleOptions options;
  options.roughness = 0.0;
  const SplineTrajectory drive = make_vehicle_trajectory(kBlock, hills, options);
  for (double t = 0.0; t <= 60.0; t += 0.05) {
    const SE3 T = drive.motion(t).T_world_body;
    const Eigen::Vector3d ground = T * Eigen::Vector3d(0, 0, -options.rig_height_m);
    CAPTURE(t);
    CHECK(ground.z() == Approx(hills(ground.x(), ground.y())).margin(0.1));
    // Tilted as the slope under it, give or take what the springs do.
    const Eigen::Vector2d slope(0.8 / 12.0 * std::cos(ground.x() / 12.0),
                                -0.5 / 9.0 * std::sin(ground.y() / 9.0));
    const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
    CHECK(std::acos(std::min(1.0, T.linear().col(2).dot(normal))) < 0.06);
  }
}

TEST_CASE("A braking vehicle dips its nose, in a left turn it leans to the right", "[motion]") {
  VehicleOptions options;
  options.roughness = 0.0;
  const SplineTrajectory drive = make_vehicle_trajectory(kBlock, nullptr, options);
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
  const SplineTrajectory drive = make_vehicle_trajectory(kBlock, hills, options);
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
    const SplineTrajectory drive = make_vehicle_trajectory(kBlock, nullptr, options);
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

TEST_CASE("Equal options give equal drives, another seed another", "[motion]") {
  VehicleOptions options;
  options.duration_s = 20.0;
  const SplineTrajectory a = make_vehicle_trajectory(kBlock, hills, options);
  const SplineTrajectory b = make_vehicle_trajectory(kBlock, hills, options);
  options.seed = 2;
  const SplineTrajectory c = make_vehicle_trajectory(kBlock, hills, options);
  for (double t = 0.0; t <= 20.0; t += 0.5)
    CHECK(a.motion(t).T_world_body.matrix() == b.motion(t).T_world_body.matrix());
  CHECK_FALSE(a.motion(15.0).T_world_body.isApprox(c.motion(15.0).T_world_body, 1e-3));
}

TEST_CASE("The start's way along the route is where the vehicle starts", "[motion]") {
  VehicleOptions options;
  options.duration_s = 3.0;
  const RoutePath path(kBlock, options.corner_radius_m);
  for (const double start : {0.0, 30.0, 130.0, path.length_m() + 10.0}) {
    options.start_m = start;
    const SplineTrajectory drive = make_vehicle_trajectory(kBlock, nullptr, options);
    const Eigen::Vector3d p = drive.motion(0.0).T_world_body.translation();
    CHECK((p.head<2>() - path.at(start).position).norm() < 0.3);
    CHECK(p.z() == Approx(1.5).margin(0.03));
  }
}

TEST_CASE("A vehicle refuses options that cannot be driven", "[motion]") {
  const auto refused = [](auto change) {
    VehicleOptions options;
    change(options);
    CHECK_THROWS_AS(make_vehicle_trajectory(kBlock, nullptr, options), ConfigError);
  };
  refused([](VehicleOptions& o) { o.duration_s = 0.0; });
  refused([](VehicleOptions& o) { o.duration_s = std::nan(""); });
  refused([](VehicleOptions& o) { o.start_m = -1.0; });
  refused([](VehicleOptions& o) { o.standstill_s = -1.0; });
  refused([](VehicleOptions& o) { o.corner_radius_m = 0.0; });
  refused([](VehicleOptions& o) { o.max_lateral_mps2 = 0.0; });
  refused([](VehicleOptions& o) { o.max_longitudinal_mps2 = -1.0; });
  refused([](VehicleOptions& o) { o.roughness = -1.0; });
  Route still = kBlock;
  still.speed_mps = 0.0;
  CHECK_THROWS_AS(make_vehicle_trajectory(still, nullptr, {}), std::invalid_argument);
}

}  // namespace
}  // namespace km
