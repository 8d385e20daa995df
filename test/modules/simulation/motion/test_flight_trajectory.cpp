#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "modules/simulation/motion/default_rig.hpp"
#include "modules/simulation/motion/flight_trajectory.hpp"
#include "test/modules/simulation/motion/motion_checks.hpp"

namespace km {
namespace {

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
    // What is not gravity and not the drag of the rotors.
    const Eigen::Vector3d thrust =
        m.acceleration_world + 0.3 * m.velocity_world + Eigen::Vector3d(0, 0, 9.81);
    // The spline through poses every 10 ms smooths both a little: less than 3 mrad.
    CHECK(std::acos(std::min(1.0, thrust.normalized().dot(m.T_world_body.linear().col(2)))) < 3e-3);
  }
}

TEST_CASE("The body is mounted in the vehicle as it is told", "[motion]") {
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

TEST_CASE("Equal options give equal flights, another seed another", "[motion]") {
  FlightOptions options;
  options.duration_s = 20.0;
  const SplineTrajectory a = make_flight_trajectory(kRoom, options);
  const SplineTrajectory b = make_flight_trajectory(kRoom, options);
  options.seed = 2;
  const SplineTrajectory c = make_flight_trajectory(kRoom, options);
  for (double t = 0.0; t <= 20.0; t += 0.5)
    CHECK(a.motion(t).T_world_body.matrix() == b.motion(t).T_world_body.matrix());
  CHECK_FALSE(a.motion(15.0).T_world_body.isApprox(c.motion(15.0).T_world_body, 1e-3));
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

}  // namespace
}  // namespace km
