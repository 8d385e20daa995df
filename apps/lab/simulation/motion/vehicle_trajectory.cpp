#include "apps/lab/simulation/motion/vehicle_trajectory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <vector>

#include "apps/lab/simulation/motion/road.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

constexpr double kCornerRadius_m = 5.0;        // smaller if the route leaves no room
constexpr double kMaxLateral_mps2 = 2.5;       // in curves
constexpr double kMaxLongitudinal_mps2 = 1.5;  // speeding up and braking
constexpr double kStopEvery_m = 150.0;         // mean distance between short stops
constexpr double kRoughness = 2.0;             // road, ISO 8608: 1 is class A, 2 B, 4 C
constexpr double kInterval_s = 0.01;
constexpr std::size_t kBeyondEnd = 4;  // points at or after the end
constexpr double kStep_m = 0.25;
// Shares of the limits that are used. Smoothing in time averages accelerations, but carries speed
// into curves.
constexpr double kLateralShare = 0.92;
constexpr double kLongitudinalShare = 0.97;
constexpr double kFirstStop_m = 20.0;
constexpr double kPedalTime_s = 0.3;    // standard deviation of the smoothing: a foot's speed
constexpr std::size_t kLookAround = 6;  // steps before and after a curve that share its limit
constexpr double kSmoothReach = 4.0;    // standard deviations

// A vehicle's plan over equidistant points of its path.
struct SpeedPlan {
  std::vector<double> limit_mps;
  std::map<std::size_t, double> dwell_s;  // duration of the stop, by index of the point
};

double curve_limit(double curvature) {
  return std::sqrt(kLateralShare * kMaxLateral_mps2 / std::max(std::abs(curvature), 1e-6));
}

// Limits from the road and its curves; each also holds for the points around it.
std::vector<double> road_limits(const RoutePath& path, double speed_mps, std::size_t count,
                                const VehicleOptions& options) {
  std::vector<double> own(count), limits(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double way = options.start_m + kStep_m * static_cast<double>(k);
    own[k] = std::min(speed_mps, curve_limit(path.at(way).curvature));
  }
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t from = k < kLookAround ? 0 : k - kLookAround;
    const std::size_t to = std::min(count, k + kLookAround + 1);
    limits[k] = *std::min_element(own.begin() + static_cast<std::ptrdiff_t>(from),
                                  own.begin() + static_cast<std::ptrdiff_t>(to));
  }
  return limits;
}

// Adds stretches slower than allowed, as in traffic, and stops.
SpeedPlan plan_speeds(std::vector<double> limits, double speed_mps, const VehicleOptions& options) {
  SpeedPlan plan{std::move(limits), {}};
  const std::size_t count = plan.limit_mps.size();
  auto pace = SeededRandom::stream(options.seed, 11);
  for (std::size_t k = 0; k < count;) {
    const auto until = k + static_cast<std::size_t>(pace.uniform(25.0F, 70.0F) / kStep_m);
    const double limit = speed_mps * pace.uniform(0.75F, 1.0F);
    for (; k < std::min(until, count); ++k) plan.limit_mps[k] = std::min(plan.limit_mps[k], limit);
  }
  plan.limit_mps[0] = 0.0;
  auto stops = SeededRandom::stream(options.seed, 12);
  for (double way = 0.0;;) {
    way += std::max(kFirstStop_m, kStopEvery_m * (0.5 + stops.unit()));
    const double dwell = 1.0 + 1.5 * stops.unit();
    const auto k = static_cast<std::size_t>(way / kStep_m);
    if (k >= count) return plan;
    plan.limit_mps[k] = 0.0;
    plan.dwell_s[k] = dwell;
  }
}

// Fastest speeds within the limits when v^2 changes by at most 2 a per metre, both ways.
std::vector<double> fastest(const std::vector<double>& limits, double acceleration_mps2) {
  std::vector<double> speeds = limits;
  const double gain = 2.0 * acceleration_mps2 * kStep_m;
  for (std::size_t k = 1; k < speeds.size(); ++k)
    speeds[k] = std::min(speeds[k], std::sqrt(speeds[k - 1] * speeds[k - 1] + gain));
  for (std::size_t k = speeds.size() - 1; k > 0; --k)
    speeds[k - 1] = std::min(speeds[k - 1], std::sqrt(speeds[k] * speeds[k] + gain));
  return speeds;
}

// Distance since the start at equidistant times, with constant acceleration between points of the
// plan.
std::vector<double> ways_in_time(const std::vector<double>& speeds, const SpeedPlan& plan,
                                 double wait_s, std::size_t count) {
  std::vector<double> ways;
  double departure_s = wait_s;  // from point k, after the stop there
  for (std::size_t k = 0; k + 1 < speeds.size() && ways.size() < count; ++k) {
    const auto dwell = plan.dwell_s.find(k);
    if (dwell != plan.dwell_s.end()) departure_s += dwell->second;
    const double way = kStep_m * static_cast<double>(k);
    const double duration = 2.0 * kStep_m / (speeds[k] + speeds[k + 1]);
    const double acceleration = (speeds[k + 1] - speeds[k]) / duration;
    while (ways.size() < count) {
      const double t = kInterval_s * static_cast<double>(ways.size()) - departure_s;
      if (t >= duration) break;
      ways.push_back(t <= 0.0 ? way : way + t * (speeds[k] + 0.5 * acceleration * t));
    }
    departure_s += duration;
  }
  return ways;
}

// Convolution with a Gaussian; the result is shorter by its reach at both ends.
std::vector<double> smoothed(const std::vector<double>& values, double sigma_s, int reach) {
  std::vector<double> weights;
  double sum = 0.0;
  for (int d = -reach; d <= reach; ++d) {
    const double x = d * kInterval_s / sigma_s;
    weights.push_back(std::exp(-0.5 * x * x));
    sum += weights.back();
  }
  std::vector<double> out;
  for (std::size_t k = 0; k + weights.size() <= values.size(); ++k) {
    double value = 0.0;
    for (std::size_t d = 0; d < weights.size(); ++d) value += weights[d] * values[k + d];
    out.push_back(value / sum);
  }
  return out;
}

// Drives along `path` from `options.start_m`: a standstill, then at most `speed_mps`, slower in
// curves, with seeded changes of speed and stops. Accelerations change smoothly. The result is the
// fastest profile within the limits of `options` (forward and backward pass over v^2). Returns the
// distance driven until each instant [m], one every kInterval_s from time 0 until shortly after the
// end.
std::vector<double> drive(const RoutePath& path, double speed_mps, const VehicleOptions& options) {
  const int reach = static_cast<int>(std::ceil(kSmoothReach * kPedalTime_s / kInterval_s));
  const double reach_s = (reach + 3) * kInterval_s;  // 3: the spline of the poses
  const auto count =
      static_cast<std::size_t>(std::ceil(options.duration_s / kInterval_s)) + kBeyondEnd;
  const double farthest = speed_mps * (options.duration_s + 2.0 * reach_s) + 10.0;

  const auto points = static_cast<std::size_t>(farthest / kStep_m);
  const SpeedPlan plan =
      plan_speeds(road_limits(path, speed_mps, points, options), speed_mps, options);
  const std::vector<double> speeds =
      fastest(plan.limit_mps, kLongitudinalShare * kMaxLongitudinal_mps2);
  // The smoothing begins `reach` before time 0 and sees `reach` ahead of the end of the standstill.
  std::vector<double> ways =
      smoothed(ways_in_time(speeds, plan, options.standstill_s + 2.0 * reach_s,
                            count + 2 * static_cast<std::size_t>(reach)),
               kPedalTime_s, reach);
  for (double& way : ways) way += options.start_m;
  return ways;
}

using GroundHeight = std::function<double(double, double)>;

constexpr double kWheelbase_m = 2.7;
constexpr double kTrack_m = 1.6;
constexpr double kTyreStep_m = 0.15;
constexpr std::array<double, 5> kTyreWeights = {0.0625, 0.25, 0.375, 0.25, 0.0625};
constexpr double kWander_m = 0.08;          // standard deviation of the driver's aim
constexpr double kWanderInterval_m = 12.0;  // way over which it changes
constexpr double kQuinticShrink =
    0.63;  // factor on the standard deviation of white noise by the spline through it

// Lateral offset of the driver to the left of the path, by distance.
UniformSpline<1> wander(double begin_m, double end_m, std::uint64_t seed) {
  GaussianRandom random(SeededRandom::stream(seed, 21));
  std::vector<UniformSpline<1>::Vector> controls;
  const int intervals = static_cast<int>(std::ceil((end_m - begin_m) / kWanderInterval_m));
  for (int k = -5; k < intervals; ++k)
    controls.emplace_back(kWander_m / kQuinticShrink * std::clamp(random.draw(), -2.0, 2.0));
  return {begin_m, kWanderInterval_m, std::move(controls)};
}

// Heave, pitch and roll of a body: height of the point midway between the wheels [m], nose down and
// leaning right are positive [rad].
using Posture = std::array<double, 3>;

// Position on the ground of the vehicle's reference point, midway between its wheels.
struct GroundPoint {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  Eigen::Vector2d heading = Eigen::Vector2d::UnitX();  // unit vector
  double curvature = 0.0;                              // [1/m]
};

class Road {
 public:
  Road(const Route& route, const GroundHeight& ground, const VehicleOptions& options,
       double begin_m, double end_m)
      : path_(route, kCornerRadius_m),
        ground_(ground),
        wander_(wander(begin_m, end_m, options.seed)),
        left_(begin_m - kWheelbase_m, end_m + kWheelbase_m, kRoughness, options.seed * 2 + 1),
        right_(begin_m - kWheelbase_m, end_m + kWheelbase_m, kRoughness, options.seed * 2) {}

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
  [[nodiscard]] Posture under_wheels(const GroundPoint& point, double way_m) const {
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

  // A tyre averages structures shorter than itself: binomial weights along it.
  [[nodiscard]] double ground_under(const Eigen::Vector2d& contact,
                                    const Eigen::Vector2d& heading) const {
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

// The springs of a passenger car. Tilt per acceleration: about 4 and 5 degrees per g, nose up when
// speeding up, leaning outwards in curves.
constexpr double kSpringTime_s = 0.08;  // standard deviation of the smoothing
constexpr double kPitchGain = -0.007;   // [rad/(m/s^2)]
constexpr double kRollGain = 0.009;     // [rad/(m/s^2)]

// The postures of a body on springs: each value smoothed in time. The first and the last one
// continue outwards.
void spring(std::vector<Posture>& postures) {
  const int reach = static_cast<int>(std::ceil(kSmoothReach * kSpringTime_s / kInterval_s));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> values(static_cast<std::size_t>(reach), postures.front()[axis]);
    for (const Posture& posture : postures) values.push_back(posture[axis]);
    values.insert(values.end(), static_cast<std::size_t>(reach), postures.back()[axis]);
    const std::vector<double> smooth = smoothed(values, kSpringTime_s, reach);
    for (std::size_t k = 0; k < postures.size(); ++k) postures[k][axis] = smooth[k];
  }
}

// Pose of the body, `height_m` above the reference point along the body's own z axis.
SE3 body_pose(const GroundPoint& point, const Posture& posture, double height_m) {
  const auto& [heave_m, pitch_rad, roll_rad] = posture;
  const double yaw = std::atan2(point.heading.y(), point.heading.x());
  const Eigen::Matrix3d R = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()))
                                .toRotationMatrix();
  const Eigen::Vector3d ground(point.position.x(), point.position.y(), heave_m);
  return make_pose(R, ground + R * Eigen::Vector3d(0.0, 0.0, height_m));
}

}  // namespace

SplineTrajectory make_vehicle_trajectory(const Route& route, const GroundHeight& ground_height,
                                         const VehicleOptions& options) {
  const double dt = kInterval_s;
  const std::vector<double> ways =
      drive(RoutePath(route, kCornerRadius_m), route.speed_mps, options);
  const Road road(route, ground_height, options, ways.front(), ways.back());

  std::vector<GroundPoint> points;
  std::vector<Posture> postures;
  for (std::size_t k = 0; k + 1 < ways.size(); ++k) {
    const double before = ways[k == 0 ? k : k - 1];
    const GroundPoint point = road.point(ways[k]);
    const double speed = (ways[k + 1] - before) / (2.0 * dt);
    const double forward = (ways[k + 1] - 2.0 * ways[k] + before) / (dt * dt);
    Posture posture = road.under_wheels(point, ways[k]);
    posture[1] += kPitchGain * forward;
    posture[2] += kRollGain * speed * speed * point.curvature;
    points.push_back(point);
    postures.push_back(posture);
  }
  spring(postures);
  // The vehicle is at rest before the start.
  std::vector<SE3> poses(2, body_pose(points.front(), postures.front(), options.rig_height_m));
  for (std::size_t k = 0; k < points.size(); ++k)
    poses.push_back(body_pose(points[k], postures[k], options.rig_height_m));
  return spline_along(0.0, dt, poses);
}

}  // namespace km
