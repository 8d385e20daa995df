#include "apps/lab/simulation/motion/traffic.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/lab/simulation/motion/vehicle_trajectory.hpp"
#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

constexpr int kAttempts = 20;
constexpr double kCheckStep_s = 0.2;
constexpr double kMargin_s = 0.2;  // rows of a rolling shutter are before and after the stamp

// To and fro on a straight line at a constant speed.
class WalkToAndFro final : public BodyTrajectory {
 public:
  WalkToAndFro(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double speed_mps,
               double phase, std::function<double(double, double)> ground)
      : from_(from),
        way_(to - from),
        period_s_(2.0 * way_.norm() / speed_mps),
        phase_(phase),
        ground_(std::move(ground)) {}

  [[nodiscard]] double start_s() const override { return -1e9; }
  [[nodiscard]] double end_s() const override { return 1e9; }
  [[nodiscard]] BodyMotion motion(double t_s) const override {
    const double turns = t_s / period_s_ + phase_;
    const double share = turns - std::floor(turns);
    const bool back = share > 0.5;
    const Eigen::Vector2d at = from_ + (back ? 2.0 - 2.0 * share : 2.0 * share) * way_;
    const double heading = std::atan2(way_.y(), way_.x()) + (back ? std::numbers::pi : 0.0);
    BodyMotion motion;
    const double z = ground_ ? ground_(at.x(), at.y()) : 0.0;
    motion.T_world_body = make_pose(  // a person faces -y
        so3_exp({0.0, 0.0, heading + 0.5 * std::numbers::pi}), {at.x(), at.y(), z});
    return motion;
  }

 private:
  Eigen::Vector2d from_, way_;
  double period_s_, phase_;
  std::function<double(double, double)> ground_;
};

// Pose of a thing. Trajectories begin kMargin_s before the first image.
SE3 pose_on(const BodyTrajectory& way, double t_s) {
  return way.motion(std::clamp(t_s + kMargin_s, way.start_s(), way.end_s())).T_world_body;
}

// Space around a thing in its own frame that others must not enter.
struct Space {
  double along_m, across_m;
};
constexpr Space kCarSpace{5.0, 2.2};
constexpr Space kWalkerSpace{3.2, 1.5};  // around a vehicle
constexpr double kFlyingSpace_m = 0.9;

bool is_inside(const SE3& T_world_thing, const Space& space, const SE3& T_world_other) {
  const Eigen::Vector3d p = T_world_thing.inverse() * T_world_other.translation();
  return std::abs(p.x()) < space.along_m && std::abs(p.y()) < space.across_m;
}

class TrafficPlanner {
 public:
  TrafficPlanner(const World& world, const std::vector<RobotWay>& robots, double duration_s,
                 std::uint64_t seed)
      : world_(world), robots_(robots), duration_s_(duration_s), random_(seed) {}

  Traffic plan(const TrafficConfig& config) {
    Scene scene(1);
    SeededRandom looks = SeededRandom::stream(1, 50);
    const int cars = world_.ground_height ? config.cars : 0;
    for (int i = 0; i < cars; ++i) {
      if (!add_free([this] { return draw_car(); }, cars_)) continue;
      add_car(scene, looks);
    }
    for (int i = 0; i < config.people; ++i)
      if (add_free([this] { return draw_walker(); }, walkers_)) add_person(scene, looks);
    Traffic traffic;
    scene.move_to(traffic.shapes);
    traffic.shapes.name = "traffic";
    for (auto* ways : {&cars_, &walkers_})
      for (auto& way : *ways) traffic.ways.push_back(std::move(way));
    return traffic;
  }

 private:
  using Way = std::unique_ptr<const BodyTrajectory>;

  template <typename Draw>
  bool add_free(const Draw& draw, std::vector<Way>& to) {
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      Way way = draw();
      if (!is_free(*way, &to == &cars_)) continue;
      to.push_back(std::move(way));
      return true;
    }
    return false;
  }

  bool is_free(const BodyTrajectory& way, bool is_car) const {
    for (double t = -kMargin_s; t <= duration_s_ + kMargin_s; t += kCheckStep_s)
      if (is_blocked(pose_on(way, t), t, is_car)) return false;
    return true;
  }

  bool is_blocked(const SE3& T_world_mover, double t_s, bool is_car) const {
    const Space space = is_car ? kCarSpace : kWalkerSpace;
    const bool drives = !world_.routes.empty();
    for (const RobotWay& robot : robots_) {
      const SE3 T_world_robot = robot(t_s);
      const Eigen::Vector3d apart = T_world_robot.translation() - T_world_mover.translation();
      if (drives ? is_inside(T_world_robot, space, T_world_mover) ||
                       (is_car && is_inside(T_world_mover, space, T_world_robot))
                 : apart.head<2>().norm() < kFlyingSpace_m)
        return true;
    }
    for (const Way& car : cars_) {
      const SE3 T_world_car = pose_on(*car, t_s);
      if (is_inside(T_world_car, space, T_world_mover) ||
          (is_car && is_inside(T_world_mover, space, T_world_car)))
        return true;
    }
    return false;
  }

  Way draw_car() {
    Route route = world_.routes[static_cast<std::size_t>(
        random_.below(static_cast<int>(world_.routes.size())))];
    if (random_.chance(0.6)) route = opposite_route(route);
    VehicleOptions vehicle{.seed = static_cast<std::uint64_t>(random_.below(1 << 30)),
                           .duration_s = duration_s_ + 1.0 + 2.0 * kMargin_s,
                           .start_m = 300.0 * random_.unit(),
                           .standstill_s = 0.0,
                           .rig_height_m = 0.0};
    return std::make_unique<SplineTrajectory>(
        make_vehicle_trajectory(route, world_.ground_height, vehicle));
  }

  Way draw_walker() {
    const double speed_mps = 1.0 + 0.6 * random_.unit(), phase = random_.unit();
    const auto [from, to] = world_.routes.empty() ? line_in_room() : line_at_route();
    return std::make_unique<WalkToAndFro>(from, to, speed_mps, phase, world_.ground_height);
  }

  using Line = std::pair<Eigen::Vector2d, Eigen::Vector2d>;

  Line line_in_room() {
    const Eigen::AlignedBox3d& box = world_.flight_volume;
    const auto draw = [&] {
      const double x = random_.unit(), y = random_.unit();
      return Eigen::Vector2d(box.min().x() + x * box.sizes().x(),
                             box.min().y() + y * box.sizes().y());
    };
    const Eigen::Vector2d from = draw(), to = draw();
    return {from, to};
  }

  // Across the road, or along its right-hand sidewalk.
  Line line_at_route() {
    const auto& points =
        world_
            .routes[static_cast<std::size_t>(random_.below(static_cast<int>(world_.routes.size())))]
            .points;
    const auto side = static_cast<std::size_t>(random_.below(static_cast<int>(points.size())));
    const Eigen::Vector2d a = points[side], b = points[(side + 1) % points.size()];
    const Eigen::Vector2d forward = (b - a).normalized();
    const Eigen::Vector2d right(forward.y(), -forward.x());
    const Eigen::Vector2d at = a + (0.2 + 0.6 * random_.unit()) * (b - a);
    if (random_.chance(0.5)) return {at - 4.5 * right, at + 1.3 * right};
    const double lateral_m = 4.6 + 0.8 * random_.unit();
    return {at - 8.0 * forward + lateral_m * right, at + 8.0 * forward + lateral_m * right};
  }

  const World& world_;
  const std::vector<RobotWay>& robots_;
  double duration_s_;
  SeededRandom random_;
  std::vector<Way> cars_, walkers_;
};

}  // namespace

std::vector<SE3> Traffic::poses(double t_s) const {
  std::vector<SE3> poses;
  for (const auto& way : ways) poses.push_back(pose_on(*way, t_s));
  return poses;
}

Traffic make_traffic(const World& world, const TrafficConfig& config,
                     const std::vector<RobotWay>& robots, double duration_s, std::uint64_t seed) {
  checked(config);
  return TrafficPlanner(world, robots, duration_s, seed).plan(config);
}

}  // namespace km
