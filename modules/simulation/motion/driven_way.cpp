#include "modules/simulation/motion/driven_way.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>

#include "modules/simulation/world/seeded_random.hpp"

namespace km {
namespace {

constexpr double kStep_m = 0.25;
// Of the limits. Smoothing in time averages accelerations, but carries speed into curves.
constexpr double kLateralShare = 0.92;
constexpr double kLongitudinalShare = 0.97;
constexpr double kFirstStop_m = 20.0;
constexpr double kPedalTime_s = 0.3;    // standard deviation of the smoothing: a foot's speed
constexpr std::size_t kLookAround = 6;  // steps before and after a curve that share its limit
constexpr double kSmoothReach = 4.0;    // standard deviations

// A vehicle's plan over equidistant points of its way.
struct SpeedPlan {
  std::vector<double> limit_mps;
  std::map<std::size_t, double> dwell_s;  // at points where it stands
};

double curve_limit(double curvature, const VehicleOptions& options) {
  return std::sqrt(kLateralShare * options.max_lateral_mps2 / std::max(std::abs(curvature), 1e-6));
}

// Limits from the road and its curves, each over the points around it as well.
std::vector<double> road_limits(const RoutePath& path, double speed_mps, std::size_t count,
                                const VehicleOptions& options) {
  std::vector<double> own(count), limits(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double way = options.start_m + kStep_m * static_cast<double>(k);
    own[k] = std::min(speed_mps, curve_limit(path.at(way).curvature, options));
  }
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t from = k < kLookAround ? 0 : k - kLookAround;
    const std::size_t to = std::min(count, k + kLookAround + 1);
    limits[k] = *std::min_element(own.begin() + static_cast<std::ptrdiff_t>(from),
                                  own.begin() + static_cast<std::ptrdiff_t>(to));
  }
  return limits;
}

// Stretches driven slower than allowed, as traffic has it, and stops.
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
  if (options.stop_every_m <= 0.0) return plan;
  auto stops = SeededRandom::stream(options.seed, 12);
  for (double way = 0.0;;) {
    way += std::max(kFirstStop_m, options.stop_every_m * (0.5 + stops.unit()));
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

// Way since the start at equidistant times, constant acceleration between the points of the plan.
std::vector<double> ways_in_time(const std::vector<double>& speeds, const SpeedPlan& plan,
                                 double wait_s, std::size_t count) {
  std::vector<double> ways;
  double arrival = wait_s;  // at point k, after standing there
  for (std::size_t k = 0; k + 1 < speeds.size() && ways.size() < count; ++k) {
    const auto dwell = plan.dwell_s.find(k);
    if (dwell != plan.dwell_s.end()) arrival += dwell->second;
    const double way = kStep_m * static_cast<double>(k);
    const double duration = 2.0 * kStep_m / (speeds[k] + speeds[k + 1]);
    const double acceleration = (speeds[k + 1] - speeds[k]) / duration;
    while (ways.size() < count) {
      const double t = DrivenWay::kInterval_s * static_cast<double>(ways.size()) - arrival;
      if (t >= duration) break;
      ways.push_back(t <= 0.0 ? way : way + t * (speeds[k] + 0.5 * acceleration * t));
    }
    arrival += duration;
  }
  return ways;
}

// Convolution with a Gaussian of kPedalTime_s; the result is shorter by its reach at both ends.
std::vector<double> smoothed(const std::vector<double>& values, int reach) {
  std::vector<double> weights;
  double sum = 0.0;
  for (int d = -reach; d <= reach; ++d) {
    const double x = d * DrivenWay::kInterval_s / kPedalTime_s;
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

}  // namespace

DrivenWay drive(const RoutePath& path, double speed_mps, const VehicleOptions& options) {
  const int reach =
      static_cast<int>(std::ceil(kSmoothReach * kPedalTime_s / DrivenWay::kInterval_s));
  const double reach_s = (reach + 3) * DrivenWay::kInterval_s;  // 3: the spline of the poses
  const auto count =
      static_cast<std::size_t>(std::ceil(options.duration_s / DrivenWay::kInterval_s)) +
      DrivenWay::kBeyondEnd;
  const double farthest = speed_mps * (options.duration_s + 2.0 * reach_s) + 10.0;

  const auto points = static_cast<std::size_t>(farthest / kStep_m);
  const SpeedPlan plan =
      plan_speeds(road_limits(path, speed_mps, points, options), speed_mps, options);
  const std::vector<double> speeds =
      fastest(plan.limit_mps, kLongitudinalShare * options.max_longitudinal_mps2);
  // The smoothing begins `reach` before time 0 and sees `reach` ahead of the end of the standstill.
  DrivenWay driven{smoothed(ways_in_time(speeds, plan, options.standstill_s + 2.0 * reach_s,
                                         count + 2 * static_cast<std::size_t>(reach)),
                            reach)};
  for (double& way : driven.way_m) way += options.start_m;
  return driven;
}

}  // namespace km
