#include "modules/simulation/motion/vehicle_trajectory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/simulation/motion/driven_way.hpp"
#include "modules/simulation/motion/gaussian_random.hpp"
#include "modules/simulation/motion/road_profile.hpp"
#include "modules/simulation/motion/route_path.hpp"
#include "modules/simulation/motion/suspension.hpp"

namespace km {
namespace {

using GroundHeight = std::function<double(double, double)>;

constexpr double kSlowest_mps = 0.1;  // of a route
constexpr double kFastest_mps = 60.0;
constexpr double kWheelbase_m = 2.7;
constexpr double kTrack_m = 1.6;
constexpr double kTyreStep_m = 0.15;
constexpr std::array<double, 5> kTyreWeights = {0.0625, 0.25, 0.375, 0.25, 0.0625};
constexpr double kWander_m = 0.08;          // standard deviation of the driver's aim
constexpr double kWanderInterval_m = 12.0;  // way over which it changes
constexpr double kQuinticShrink = 0.63;     // of white noise by the spline through it

// How far to the left of the path the driver keeps, by way.
UniformSpline<1> wander(double begin_m, double end_m, std::uint64_t seed) {
  GaussianRandom random(SeededRandom::stream(seed, 21));
  std::vector<UniformSpline<1>::Vector> controls;
  const double intervals = std::ceil((end_m - begin_m) / kWanderInterval_m);
  for (double k = -5.0; k < intervals; ++k)
    controls.emplace_back(kWander_m / kQuinticShrink * std::clamp(random.draw(), -2.0, 2.0));
  return {begin_m, kWanderInterval_m, std::move(controls)};
}

// Where the vehicle's reference point, in the middle between its wheels, is on the ground.
struct GroundPoint {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  Eigen::Vector2d heading = Eigen::Vector2d::UnitX();  // unit vector
  double curvature = 0.0;                              // [1/m]
};

class Road {
 public:
  Road(const Route& route, const GroundHeight& ground, const VehicleOptions& options,
       double begin_m, double end_m)
      : path_(route, options.corner_radius_m),
        ground_(ground),
        wander_(wander(begin_m, end_m, options.seed)),
        left_(begin_m - kWheelbase_m, end_m + kWheelbase_m, options.roughness,
              options.seed * 2 + 1),
        right_(begin_m - kWheelbase_m, end_m + kWheelbase_m, options.roughness, options.seed * 2) {}

  [[nodiscard]] GroundPoint point(double way_m) const {
    const RoutePath::Point center = path_.at(way_m);
    const auto offset = wander_.at(way_m);
    const Eigen::Vector2d left(-center.tangent.y(), center.tangent.x());
    // Derivative of position + offset * left by the way; left' = -curvature * tangent.
    const Eigen::Vector2d along =
        (1.0 - center.curvature * offset.value[0]) * center.tangent + offset.first[0] * left;
    return {center.position + offset.value[0] * left, along.normalized(),
            center.curvature + offset.second[0]};
  }

  // Heave, pitch and roll of a rigid body on four wheels without springs.
  [[nodiscard]] SprungBody under_wheels(const GroundPoint& point, double way_m) const {
    const double front_left = wheel(point, way_m, 1.0, 1.0);
    const double front_right = wheel(point, way_m, 1.0, -1.0);
    const double rear_left = wheel(point, way_m, -1.0, 1.0);
    const double rear_right = wheel(point, way_m, -1.0, -1.0);
    return {0.25 * (front_left + front_right + rear_left + rear_right),
            std::atan2(0.5 * (rear_left + rear_right - front_left - front_right), kWheelbase_m),
            std::atan2(0.5 * (front_left + rear_left - front_right - rear_right), kTrack_m)};
  }

 private:
  [[nodiscard]] double wheel(const GroundPoint& point, double way_m, double forward,
                             double left) const {
    const Eigen::Vector2d to_left(-point.heading.y(), point.heading.x());
    const Eigen::Vector2d contact = point.position + 0.5 * kWheelbase_m * forward * point.heading +
                                    0.5 * kTrack_m * left * to_left;
    const RoadProfile& profile = left > 0.0 ? left_ : right_;
    return ground_under(contact, point.heading) +
           profile.height_m(way_m + 0.5 * kWheelbase_m * forward);
  }

  // A tyre bridges what is shorter than itself: binomial weights along it.
  [[nodiscard]] double ground_under(const Eigen::Vector2d& contact,
                                    const Eigen::Vector2d& heading) const {
    if (!ground_) return 0.0;
    double height = 0.0;
    for (int k = -2; k <= 2; ++k) {
      const Eigen::Vector2d at = contact + k * kTyreStep_m * heading;
      height += kTyreWeights[static_cast<std::size_t>(k + 2)] * ground_(at.x(), at.y());
    }
    return height;
  }

  RoutePath path_;
  const GroundHeight& ground_;
  UniformSpline<1> wander_;
  RoadProfile left_, right_;
};

// Pose of the body, `height_m` above the reference point along the body's own z axis.
SE3 body_pose(const GroundPoint& point, const SprungBody& body, double height_m) {
  const double yaw = std::atan2(point.heading.y(), point.heading.x());
  const Eigen::Matrix3d R = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(body.pitch_rad, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(body.roll_rad, Eigen::Vector3d::UnitX()))
                                .toRotationMatrix();
  const Eigen::Vector3d ground(point.position.x(), point.position.y(), body.heave_m);
  return make_pose(R, ground + R * Eigen::Vector3d(0.0, 0.0, height_m));
}

}  // namespace

SplineTrajectory make_vehicle_trajectory(const Route& route, const GroundHeight& ground_height,
                                         const VehicleOptions& options) {
  checked(options);
  if (!(route.speed_mps >= kSlowest_mps && route.speed_mps <= kFastest_mps))
    throw std::invalid_argument("route: speed " + std::to_string(route.speed_mps) +
                                " m/s is outside [0.1, 60]");
  const double dt = DrivenWay::kInterval_s;
  const std::vector<double> ways =
      drive(RoutePath(route, options.corner_radius_m), route.speed_mps, options).way_m;
  const Road road(route, ground_height, options, ways.front(), ways.back());

  std::vector<SE3> poses;
  SprungBody body = road.under_wheels(road.point(ways.front()), ways.front());
  Suspension suspension(body);
  for (std::size_t k = 0; k + 1 < ways.size(); ++k) {
    const double before = ways[k == 0 ? k : k - 1];
    const GroundPoint point = road.point(ways[k]);
    const double speed = (ways[k + 1] - before) / (2.0 * dt);
    const double forward = (ways[k + 1] - 2.0 * ways[k] + before) / (dt * dt);
    if (k > 0)
      body = suspension.step(road.under_wheels(point, ways[k]), forward,
                             speed * speed * point.curvature, dt);
    poses.push_back(body_pose(point, body, options.rig_height_m));
    if (k == 0) poses.insert(poses.end(), 2, poses.back());  // at rest before the start
  }
  return spline_along(0.0, dt, poses);
}

}  // namespace km
