#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "apps/lab/simulation/world/canvas.hpp"
#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/terrain.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

constexpr float kTrackHalf_m = 3.4F;   // half of the worn width
constexpr float kTrackClear_m = 4.2F;  // nothing stands nearer to a track's middle
constexpr float kCampHalfX_m = 92.0F;  // the fence
constexpr float kCampHalfY_m = 66.0F;
constexpr double kTrackSpeed_mps = 7.5;

/// Dirt tracks of a camp and its ground: crossings in 4 columns and 3 rows, six yards in between.
/// Objects are built on a level plane, and move with ground() at the end.
struct CampPlan {
  std::uint64_t seed;
  std::array<float, 4> x{};  ///< Middles of the tracks along y [m].
  std::array<float, 3> y{};  ///< Middles of the tracks along x [m].

  explicit CampPlan(std::uint64_t plan_seed) : seed(plan_seed) {
    SeededRandom random = SeededRandom::stream(seed, 50);
    for (std::size_t i = 0; i < x.size(); ++i)
      x[i] = 53.0F * (static_cast<float>(i) - 1.5F) + random.uniform(-3.0F, 3.0F);
    for (std::size_t j = 0; j < y.size(); ++j)
      y[j] = 44.0F * (static_cast<float>(j) - 1.0F) + random.uniform(-3.0F, 3.0F);
  }

  [[nodiscard]] Vector2f yard_center(std::size_t column, std::size_t row) const {
    return 0.5F * Vector2f(x[column] + x[column + 1], y[row] + y[row + 1]);
  }

  /// Distance from the middle of the nearest track [m].
  [[nodiscard]] float distance_to_track(const Vector2f& p) const {
    const float beyond_x = std::max({x.front() - p.x(), p.x() - x.back(), 0.0F});
    const float beyond_y = std::max({y.front() - p.y(), p.y() - y.back(), 0.0F});
    float least = std::hypot(beyond_x, beyond_y) + 1e3F;
    for (const float at : x) least = std::min(least, std::hypot(p.x() - at, beyond_y));
    for (const float at : y) least = std::min(least, std::hypot(p.y() - at, beyond_x));
    return least;
  }

  /// Height of the ground [m]: waves and bumps, worn tracks that lie deeper, hills that close the
  /// view.
  [[nodiscard]] float ground(float px, float py) const {
    const auto noise = [&](float feature_m, std::uint64_t part) {
      return ground_noise(px, py, feature_m, seed + part);
    };
    const float outside =
        std::max({std::abs(px) - kCampHalfX_m - 6.0F, std::abs(py) - kCampHalfY_m - 6.0F, 0.0F});
    const float hills = smooth_step(0.0F, 60.0F, outside) * (9.0F + 5.0F * noise(38.0F, 2));
    const float track = distance_to_track({px, py});
    const float wild = smooth_step(kTrackHalf_m - 0.6F, kTrackHalf_m + 2.0F, track);
    const float bumps = 0.1F * noise(3.7F, 3) + 0.06F * noise(1.5F, 4);
    const float worn = 0.05F * noise(3.1F, 5) - 0.1F;
    return 1.3F * noise(46.0F, 0) + 0.35F * noise(17.0F, 1) + hills + wild * bumps +
           (1.0F - wild) * worn;
  }

  [[nodiscard]] std::vector<Route> routes() const {
    return crossing_routes(x, y, {0.5, 0.5}, 0.5 * static_cast<double>(kLanesApart_m),
                           kTrackSpeed_mps);
  }
};

/// Adds an object to a scene.
using Add = std::function<void(Scene&, SeededRandom&)>;

Add prop(Prop prop) {
  return [prop](Scene& scene, SeededRandom& random) { add_prop(scene, prop, random); };
}

/// A tent in the frame of its middle.
Add tent(Tent kind, const Vector3f& cloth, float middle_m = 0.0F) {
  return [=](Scene& scene, SeededRandom&) {
    scene.at({0.0F, -middle_m, 0.0F}).add(add_tent, kind, cloth);
  };
}

/// Keeps objects of a camp off the tracks and apart from each other.
class CampSite {
 public:
  CampSite(Scene& scene, const CampPlan& plan, SeededRandom& random)
      : scene_(scene), plan_(plan), random_(random) {}

  /// Adds an object at `p`, unless another is within `radius_m`. Returns true if it did.
  bool stand(const Vector2f& p, float yaw_rad, float radius_m, const Add& add) {
    if (plan_.distance_to_track(p) < kTrackClear_m + radius_m) return false;
    for (const auto& [center, other_m] : claims_)
      if ((center - p).norm() < other_m + radius_m) return false;
    claims_.emplace_back(p, radius_m);
    const auto frame = scene_.at({p.x(), p.y(), 0.0F}, yaw_rad);
    add(scene_, random_);
    return true;
  }

  /// Draws places in the camp until `count` objects have a place.
  void scatter(int count, float radius_m, const Add& add) {
    for (int tries = 0; count > 0 && tries < 6000; ++tries) {
      const float x = random_.uniform(-kCampHalfX_m + 3.0F, kCampHalfX_m - 3.0F);
      const float y = random_.uniform(-kCampHalfY_m + 3.0F, kCampHalfY_m - 3.0F);
      if (stand({x, y}, random_.uniform(0.0F, kTwoPi), radius_m, add)) --count;
    }
  }

 private:
  Scene& scene_;
  const CampPlan& plan_;
  SeededRandom& random_;
  std::vector<std::pair<Vector2f, float>> claims_;
};

const Vector3f kOliveCloth(0.2F, 0.22F, 0.12F);
const Vector3f kSandCloth(0.55F, 0.46F, 0.32F);
const Vector3f kWhiteCloth(0.72F, 0.71F, 0.68F);

/// Rows of equal tents.
void add_tent_rows(CampSite& site, const Vector2f& center) {
  for (float row = -1; row <= 1; ++row)
    for (float column = -2; column <= 2; ++column)
      site.stand(center + Vector2f(6.6F * column, 9.0F * row), 0.0F, 2.9F,
                 tent(Tent::kRidge, kOliveCloth, 2.0F));
}

/// Objects between the tracks: tents in rows (two yards of equal ones), headquarters, domes,
/// containers, vehicles.
void add_yards(CampSite& site, const CampPlan& plan, SeededRandom& random) {
  add_tent_rows(site, plan.yard_center(0, 1));
  add_tent_rows(site, plan.yard_center(2, 0));
  const auto at = [&](std::size_t column, std::size_t row, float dx, float dy) -> Vector2f {
    return plan.yard_center(column, row) + Vector2f(dx, dy);
  };
  for (float row = -1; row <= 1; ++row)
    for (float column = -1; column <= 1; ++column)
      site.stand(at(1, 1, 8.5F * column, 8.0F * row), random.chance(0.6) ? 0.0F : 0.5F * kPi, 3.4F,
                 prop(Prop::kContainer));
  for (float i = -2.5F; i < 3.0F; ++i) {
    const float askew = random.uniform(-0.06F, 0.06F);
    site.stand(at(2, 1, 5.2F * i, -7.0F), 0.5F * kPi + askew, 2.6F, prop(Prop::kTruck));
    site.stand(at(2, 1, 5.2F * i, 6.0F), askew - 0.5F * kPi, 2.4F, prop(Prop::kJeep));
  }
  site.stand(at(0, 0, -9.0F, 2.0F), 0.0F, 6.5F, tent(Tent::kTunnel, kSandCloth, 5.4F));
  site.stand(at(0, 0, 5.0F, -6.0F), 0.5F * kPi, 5.6F, tent(Tent::kHouse, kSandCloth, 4.0F));
  site.stand(at(0, 0, 5.0F, 7.0F), 0.5F * kPi, 5.6F, tent(Tent::kHouse, kWhiteCloth, 4.0F));
  for (float i = 0.0F; i < 5.0F; ++i) {
    const float angle = kTwoPi * i / 5.0F;
    site.stand(at(1, 0, 11.0F * std::cos(angle), 9.5F * std::sin(angle)), angle - 0.5F * kPi, 3.8F,
               tent(Tent::kDome, i < 3.0F ? kSandCloth : kWhiteCloth));
  }
}

/// Cover of the ground: track, trodden earth or grass, with irregular borders; meadow outside.
void add_camp_ground(Scene& scene, const CampPlan& plan) {
  const auto grass = scene.paint(SurfaceClass::kTerrain, kGrass);
  const auto bare = scene.paint(SurfaceClass::kTerrain, kSoil, {1.05F, 1.0F, 0.85F});
  const auto track = scene.paint(SurfaceClass::kRoad, kSoil);
  constexpr float kCell_m = 0.5F;
  const Vector2f low(-100.0F, -76.0F);
  const auto at = [&](float row, float column) -> Vector2f {
    return low + kCell_m * Vector2f(column, row);
  };
  const auto point = [&](float row, float column) {
    const Vector2f p = at(row, column);
    return Vector3f(p.x(), p.y(), plan.ground(p.x(), p.y()));
  };
  const auto cover = [&](float row, float column) -> std::optional<MaterialId> {
    const Vector2f p = at(row + 0.5F, column + 0.5F);
    const auto noise = [&](float feature_m, std::uint64_t part) {
      return ground_noise(p.x(), p.y(), feature_m, plan.seed + part);
    };
    const float fray = 0.7F * noise(2.3F, 7) + 0.4F * noise(0.7F, 8);
    const float distance = plan.distance_to_track(p) + fray;
    if (distance < kTrackHalf_m) return track;
    const float trodden = noise(11.0F, 9) + 0.5F * fray;
    return trodden > 0.15F || distance < kTrackHalf_m + 0.7F ? bare : grass;
  };
  scene.sheet(304, 400, point, cover, true);
  const auto meadow = scene.paint(SurfaceClass::kTerrain, kGrass, {1.0F, 1.0F, 0.9F}, 2.7F);
  const auto far_point = [&](float row, float column) {
    const Vector2f p(4.0F * column - 180.0F, 4.0F * row - 156.0F);
    return Vector3f(p.x(), p.y(), plan.ground(p.x(), p.y()) - 0.3F);
  };
  const auto far_cover = [&](float row, float column) -> std::optional<MaterialId> {
    const Vector3f middle = far_point(row + 0.5F, column + 0.5F);
    if (std::abs(middle.x()) < 96.0F && std::abs(middle.y()) < 72.0F) return std::nullopt;
    return meadow;
  };
  scene.sheet(78, 90, far_point, far_cover, true);
}

/// Fence, watch towers at its corners, woods outside, and grass beside the tracks.
void add_surroundings(Scene& scene, const CampPlan& plan, CampSite& site, SeededRandom& random) {
  for (int side = 0; side < 4; ++side) {
    const bool along_x = side % 2 == 0;
    const float half = along_x ? kCampHalfX_m : kCampHalfY_m;
    const float out = along_x ? kCampHalfY_m : kCampHalfX_m;
    const float yaw = 0.5F * kPi * static_cast<float>(side);
    const auto frame = scene.at(Vector3f::Zero(), yaw);
    for (float x = -half; x < half; x += 5.0F)
      scene.at({x, -out, 0.0F}).add(add_prop, Prop::kWireFence, random);
    const Vector3f corner = standing_at({0, 0, 0}, yaw) * Vector3f(4.0F - half, 4.0F - out, 0.0F);
    site.stand(corner.head<2>(), yaw, 2.2F, prop(Prop::kWatchTower));
  }
  for (int i = 0; i < 260; ++i) {
    const float x = random.uniform(-150.0F, 150.0F);
    const float y = random.uniform(-126.0F, 126.0F);
    if (std::abs(x) < kCampHalfX_m + 4.0F && std::abs(y) < kCampHalfY_m + 4.0F) continue;
    const auto frame = scene.at({x, y, 0.0F}, random.uniform(0.0F, 6.0F));
    if (random.chance(0.7))
      add_conifer(scene, random.uniform(5.0F, 11.0F), random);
    else
      add_tree(scene, random.uniform(6.0F, 10.0F), random);
  }
  for (int i = 0; i < 14000; ++i) {
    const float x = random.uniform(-kCampHalfX_m, kCampHalfX_m);
    const float y = random.uniform(-kCampHalfY_m, kCampHalfY_m);
    const float track = plan.distance_to_track({x, y});
    if (track < kTrackHalf_m - 0.2F || track > 12.0F) continue;
    scene.at({x, y, 0.0F}).add(add_tuft, random.uniform(0.12F, 0.3F), random);
  }
}

void add_one_supply(Scene& scene, SeededRandom& random) {
  constexpr Prop kSupplies[] = {Prop::kCrates,  Prop::kCrates,    Prop::kBarrels,
                                Prop::kBarrels, Prop::kGenerator, Prop::kWaterTank,
                                Prop::kLogPile, Prop::kSandbags};
  add_prop(scene, random.pick(kSupplies), random);
}

void add_any_tree(Scene& scene, SeededRandom& random) {
  add_tree(scene, random.uniform(5.0F, 8.5F), random);
}
void add_any_bush(Scene& scene, SeededRandom& random) {
  add_bush(scene, random.uniform(0.5F, 1.0F), random);
}
void add_any_rock(Scene& scene, SeededRandom& random) {
  add_rock(scene, random.uniform(0.4F, 1.5F), random);
}

/// Places things along both edges of every track, where the robots pass.
void add_along_tracks(CampSite& site, const CampPlan& plan, SeededRandom& random) {
  struct Thing {
    float from_middle_m, radius_m;
    float turn_rad;  ///< 0: it faces the track.
    Add add;
  };
  const Thing things[] = {
      {6.2F, 1.6F, 0.0F, add_one_supply},
      {6.2F, 1.6F, 0.0F, add_one_supply},
      {6.0F, 1.6F, 0.0F, prop(Prop::kBarrier)},
      {5.2F, 0.6F, 1.0F, add_person},
      {5.6F, 1.2F, 0.0F, prop(Prop::kNoticeBoard)},
      {6.8F, 2.3F, 0.5F * kPi, prop(Prop::kJeep)},
      {8.0F, 3.4F, 0.5F * kPi, prop(Prop::kTruck)},
      {7.7F, 3.3F, 0.0F, prop(Prop::kContainer)},
      {7.7F, 3.3F, 0.0F, prop(Prop::kContainer)},
      {9.4F, 4.8F, 0.0F, tent(Tent::kHouse, kOliveCloth, 4.0F)},
      {5.0F, 0.5F, 0.0F, prop(Prop::kFloodlight)},
      {6.4F, 1.2F, 2.0F, add_any_tree},
      {5.8F, 1.0F, 3.0F, add_any_bush},
      {5.4F, 0.8F, 4.0F, add_any_rock},
  };
  const auto line = [&](const Vector2f& from, const Vector2f& to) {
    const Vector2f along = (to - from).normalized();
    for (int i = 0; i < 24; ++i) {
      const Vector2f middle = from + random.uniform(0.0F, 1.0F) * (to - from);
      const Vector2f out = random.sign() * Vector2f(along.y(), -along.x());
      const Thing& thing = random.pick(things);
      site.stand(middle + thing.from_middle_m * out,
                 std::atan2(out.y(), out.x()) - 0.5F * kPi + thing.turn_rad, thing.radius_m,
                 thing.add);
    }
  };
  for (std::size_t i = 0; i < plan.x.size(); ++i) {
    for (std::size_t j = 0; j < plan.y.size(); ++j) {
      const Vector2f crossing(plan.x[i], plan.y[j]);
      if (i + 1 < plan.x.size()) line(crossing, {plan.x[i + 1], plan.y[j]});
      if (j + 1 < plan.y.size()) line(crossing, {plan.x[i], plan.y[j + 1]});
    }
  }
}

}  // namespace

World make_camp(std::uint64_t seed) {
  const CampPlan plan(seed);
  Scene scene(seed);
  SeededRandom random = SeededRandom::stream(seed, 61);
  add_camp_ground(scene, plan);
  const std::size_t ground_vertices = scene.mesh().vertices.size();
  CampSite site(scene, plan, random);
  add_yards(site, plan, random);
  add_surroundings(scene, plan, site, random);
  add_along_tracks(site, plan, random);
  site.scatter(60, 1.8F, add_one_supply);
  site.scatter(40, 0.7F, add_person);
  site.scatter(70, 0.9F, add_any_rock);
  site.scatter(45, 1.3F, add_any_tree);
  site.scatter(40, 1.2F, add_any_bush);

  World world;
  world.name = "camp";
  scene.move_to(world);
  for (Vector3f& p : std::span(world.mesh.vertices).subspan(ground_vertices))
    p.z() += plan.ground(p.x(), p.y());
  world.lighting.to_sun = Vector3f(0.5F, -0.45F, 0.75F).normalized();
  world.lighting.sun = 0.8F;
  world.lighting.ambient = 0.32F;
  world.lighting.haze_distance_m = 700.0F;
  world.routes = plan.routes();
  world.ground_height = [plan](double x, double y) {
    return static_cast<double>(plan.ground(static_cast<float>(x), static_cast<float>(y)));
  };
  return world;
}

}  // namespace km
