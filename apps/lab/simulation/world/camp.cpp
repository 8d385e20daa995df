#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "apps/lab/simulation/world/camp_plan.hpp"
#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

/// Adds an object to a scene.
using Add = void (*)(Scene&, SeededRandom&);

/// Keeps objects of a camp off the tracks and apart from each other.
class CampSite {
 public:
  CampSite(Scene& scene, const CampPlan& plan) : scene_(scene), plan_(plan) {}

  /// Calls `add` in an upright frame on the ground at `p`, unless an object is within `radius_m`.
  /// Returns true if it did.
  bool stand(const Vector2f& p, float yaw_rad, float radius_m,
             const std::function<void(Scene&, SeededRandom&)>& add, SeededRandom& random) {
    if (!claim(p, radius_m)) return false;
    const auto z = static_cast<float>(plan_.ground(p.x(), p.y()));
    const auto frame = scene_.at({p.x(), p.y(), z}, yaw_rad);
    scene_.set_uv_offset({std::fmod(std::abs(p.x()), 5.0F), std::fmod(std::abs(p.y()), 5.0F)});
    add(scene_, random);
    scene_.set_uv_offset(Vector2f::Zero());
    return true;
  }

  /// Like stand(), with the frame tilted like the ground below a footprint of 2 `radius_m`.
  bool lie(const Vector2f& p, float yaw_rad, float radius_m,
           const std::function<void(Scene&, SeededRandom&)>& add, SeededRandom& random) {
    const Vector3f forward(std::cos(yaw_rad), std::sin(yaw_rad), 0.0F);
    const Vector3f left(-forward.y(), forward.x(), 0.0F);
    const auto ground = [&](const Vector3f& offset) {
      const float x = p.x() + offset.x();
      const float y = p.y() + offset.y();
      return Vector3f(x, y, static_cast<float>(plan_.ground(x, y)));
    };
    const float reach = 0.7F * radius_m;
    const Vector3f x_axis = (ground(reach * forward) - ground(-reach * forward)).normalized();
    const Vector3f slope = ground(reach * left) - ground(-reach * left);
    const Vector3f z_axis = x_axis.cross(slope).normalized();
    Eigen::Isometry3f tilt = Eigen::Isometry3f::Identity();
    tilt.linear() << x_axis, z_axis.cross(x_axis), z_axis;
    const auto tilted = [&](Scene& scene, SeededRandom& r) {
      const auto frame = scene.at(tilt);
      add(scene, r);
    };
    return stand(p, 0.0F, radius_m, tilted, random);
  }

 private:
  [[nodiscard]] bool claim(const Vector2f& p, float radius_m) {
    if (plan_.distance_to_track(p) < kTrackClear_m + radius_m) return false;
    const bool taken = std::ranges::any_of(claims_, [&](const Claim& other) {
      return (other.center - p).norm() < other.radius_m + radius_m;
    });
    if (!taken) claims_.push_back({p, radius_m});
    return !taken;
  }

  struct Claim {
    Vector2f center;
    float radius_m;
  };

  Scene& scene_;
  const CampPlan& plan_;
  std::vector<Claim> claims_;
};

const Vector3f kOlive(0.2F, 0.22F, 0.12F);  ///< Colours of canvas.
const Vector3f kSand(0.55F, 0.46F, 0.32F);
const Vector3f kWhite(0.72F, 0.71F, 0.68F);

/// Rows of equal tents.
void add_tent_rows(CampSite& site, const Vector2f& center, std::uint64_t seed) {
  const Add tent = [](Scene& s, SeededRandom& r) { add_ridge_tent(s, kOlive, r); };
  for (float row = 0; row < 3; ++row) {
    for (float column = 0; column < 5; ++column) {
      SeededRandom same = SeededRandom::stream(seed, 60);  // every tent is the same
      const Vector2f p = center + Vector2f(6.6F * (column - 2.0F), 9.0F * (row - 1.0F));
      site.stand(p + Vector2f(0.0F, -2.0F), 0.0F, 2.9F, tent, same);
    }
  }
}

void add_headquarters(CampSite& site, const Vector2f& center, SeededRandom& random) {
  const Add shelter = [](Scene& s, SeededRandom&) { add_tunnel_shelter(s, 10.8F, kSand); };
  const Add sand = [](Scene& s, SeededRandom& r) { add_house_tent(s, 8.0F, kSand, r); };
  const Add white = [](Scene& s, SeededRandom& r) { add_house_tent(s, 8.0F, kWhite, r); };
  site.stand(center + Vector2f(-9.0F, 2.0F), 0.0F, 6.5F, shelter, random);
  site.stand(center + Vector2f(5.0F, -6.0F), 0.5F * kPi, 5.6F, sand, random);
  site.stand(center + Vector2f(5.0F, 7.0F), 0.5F * kPi, 5.6F, white, random);
  site.stand(center + Vector2f(-1.0F, -9.0F), 0.0F, 0.6F, add_flag_pole, random);
  site.stand(center + Vector2f(-4.0F, -10.0F), 0.0F, 1.3F, add_notice_board, random);
}

void add_domes(CampSite& site, const Vector2f& center, SeededRandom& random) {
  for (int i = 0; i < 5; ++i) {
    const float angle = 2.0F * kPi * static_cast<float>(i) / 5.0F;
    const Vector2f p = center + Vector2f(11.0F * std::cos(angle), 9.5F * std::sin(angle));
    const bool big = i == 2;
    const auto dome = [&](Scene& s, SeededRandom&) {
      add_dome_tent(s, big ? 3.2F : 2.6F, i % 2 == 0 ? kSand : kWhite);
    };
    site.stand(p, angle - 0.5F * kPi, big ? 4.4F : 3.8F, dome, random);
  }
  const Add awning = [](Scene& s, SeededRandom&) { add_awning_roof(s, kOlive); };
  site.stand(center, random.uniform(0.0F, 1.0F), 3.4F, awning, random);
}

void add_container_yard(CampSite& site, const Vector2f& center, SeededRandom& random) {
  for (float row = -1; row <= 1; ++row) {
    for (float column = -1; column <= 1; ++column) {
      const Vector2f p = center + Vector2f(8.5F * column, 8.0F * row);
      const bool along = random.chance(0.6);
      const bool two = random.chance(0.35);
      const auto stack = [&](Scene& s, SeededRandom& r) {
        add_container(s, r);
        if (two) s.at({r.uniform(-0.1F, 0.1F), 0.0F, 2.6F}).add(add_container, r);
      };
      site.lie(p, along ? 0.0F : 0.5F * kPi, 3.4F, stack, random);
    }
  }
}

void add_motor_pool(CampSite& site, const Vector2f& center, SeededRandom& random) {
  const Add truck = [](Scene& s, SeededRandom& r) {
    s.at({-1.0F, 0.0F, 0.0F}).add(add_army_truck, r);
  };
  for (float i = 0; i < 6; ++i) {
    const float x = 5.2F * (i - 2.5F);
    const float askew = random.uniform(-0.06F, 0.06F);
    site.lie(center + Vector2f(x, -7.0F), 0.5F * kPi + askew, 2.6F, truck, random);
    const float turned = random.uniform(-0.08F, 0.08F);
    site.lie(center + Vector2f(x, 6.0F), -0.5F * kPi + turned, 2.4F, add_army_jeep, random);
  }
}

/// Objects between the tracks: tents in rows (two yards of equal ones), headquarters, domes,
/// containers, vehicles.
void add_yards(CampSite& site, const CampPlan& plan, std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 62);
  add_tent_rows(site, plan.yard_center(0, 1), seed);
  add_container_yard(site, plan.yard_center(1, 1), random);
  add_motor_pool(site, plan.yard_center(2, 1), random);
  add_headquarters(site, plan.yard_center(0, 0), random);
  add_domes(site, plan.yard_center(1, 0), random);
  add_tent_rows(site, plan.yard_center(2, 0), seed);  // equal to the first
}

constexpr float kSharpBorders_m =
    10.0F;  // distance from a track; cells farther away have one cover each

/// Cover of the ground at a point: track, trodden earth or grass, with irregular borders.
class GroundPaint {
 public:
  GroundPaint(Scene& scene, const CampPlan& plan, std::uint64_t seed)
      : plan_(plan),
        seed_(seed),
        grass_(scene.paint(SurfaceClass::kTerrain, kGrass)),
        bare_(scene.paint(SurfaceClass::kTerrain, kSoil, {1.05F, 1.0F, 0.85F})),
        track_(scene.paint(SurfaceClass::kRoad, kSoil)) {}

  [[nodiscard]] MaterialId operator()(const Vector2f& p) const {
    const float fray = 0.7F * ground_noise(p.x(), p.y(), 2.3F, seed_ + 7) +
                       0.4F * ground_noise(p.x(), p.y(), 0.7F, seed_ + 8);
    const float distance = plan_.distance_to_track(p) + fray;
    if (distance < kTrackHalf_m) return track_;
    const float trodden = ground_noise(p.x(), p.y(), 11.0F, seed_ + 9) + 0.5F * fray;
    return trodden > 0.15F || distance < kTrackHalf_m + 0.7F ? bare_ : grass_;
  }

 private:
  const CampPlan& plan_;
  std::uint64_t seed_;
  MaterialId grass_;
  MaterialId bare_;
  MaterialId track_;
};

/// A cell in which the cover changes, cut into 3 x 3 on the same two planes.
void add_border_cell(Scene& scene, const Heightfield& field, int row, int column,
                     const GroundPaint& paint) {
  constexpr int kParts = 3;
  const Vector2f low = field.point(row, column).head<2>();
  const float part = (field.point(row, column + 1).x() - low.x()) / kParts;
  const auto at = [&](float i, float j) {
    return Vector2f(low.x() + part * j, low.y() + part * i);
  };
  const auto point = [&](float i, float j) {
    const Vector2f p = at(i, j);
    const float s = j / kParts;
    const float t = i / kParts;
    const Vector3f normal =
        (1.0F - t) * ((1.0F - s) * field.normal(row, column) + s * field.normal(row, column + 1)) +
        t * ((1.0F - s) * field.normal(row + 1, column) + s * field.normal(row + 1, column + 1));
    const auto z = static_cast<float>(field.at(p.x(), p.y()));
    return Scene::GridPoint{{p.x(), p.y(), z}, normal, p};
  };
  const auto cell = [&](float i, float j) { return paint(at(i + 0.5F, j + 0.5F)); };
  scene.grid(kParts, kParts, point, cell);
}

void add_camp_ground(Scene& scene, const CampPlan& plan, std::uint64_t seed) {
  const GroundPaint paint(scene, plan, seed);
  const Heightfield& near = plan.near_ground();
  const auto corners_of = [&](int row, int column) {
    std::array<Vector2f, 4> corners;
    for (int i = 0; i < 4; ++i)
      corners[static_cast<std::size_t>(i)] = near.point(row + i / 2, column + i % 2).head<2>();
    return corners;
  };
  std::vector<std::array<int, 2>> borders;
  const auto point = [&](int row, int column) {
    const Vector3f p = near.point(row, column);
    return Scene::GridPoint{p, near.normal(row, column), p.head<2>()};
  };
  const auto cell = [&](int row, int column) -> std::optional<MaterialId> {
    const auto corners = corners_of(row, column);
    const auto first = paint(corners[0]);
    if (plan.distance_to_track(corners[0]) > kSharpBorders_m) return first;
    if (std::ranges::all_of(corners, [&](const Vector2f& p) { return paint(p) == first; }))
      return first;
    borders.push_back({row, column});
    return std::nullopt;
  };
  scene.grid(near.rows(), near.columns(), point, cell);
  for (const auto& [row, column] : borders) add_border_cell(scene, near, row, column, paint);
  const auto meadow = scene.paint(SurfaceClass::kTerrain, kGrass, {1.0F, 1.0F, 0.9F}, 2.7F);
  const Heightfield& far = plan.far_ground();
  const auto far_point = [&](int row, int column) { return far.point(row, column); };
  const auto far_cell = [&](int row, int column) -> std::optional<MaterialId> {
    const Vector3f middle = 0.5F * (far.point(row, column) + far.point(row + 1, column + 1));
    if (near.contains(middle.x(), middle.y())) return std::nullopt;
    return meadow;
  };
  scene.sheet(far.rows(), far.columns(), far_point, far_cell, true);
}

void add_perimeter(Scene& scene, const CampPlan& plan, CampSite& site, SeededRandom& random) {
  const Add tower = [](Scene& s, SeededRandom&) { add_watch_tower(s); };
  const Vector2f corners[] = {{-kCampHalfX_m, -kCampHalfY_m},
                              {kCampHalfX_m, -kCampHalfY_m},
                              {kCampHalfX_m, kCampHalfY_m},
                              {-kCampHalfX_m, kCampHalfY_m}};
  constexpr float kPiece_m = 5.0F;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2f a = corners[i];
    const Vector2f b = corners[(i + 1) % 4];
    const Vector2f along = (b - a).normalized();
    const int pieces = static_cast<int>((b - a).norm() / kPiece_m);
    for (int k = 0; k < pieces; ++k) {
      const Vector2f p = a + kPiece_m * static_cast<float>(k) * along;
      const Vector2f q = p + kPiece_m * along;
      const Vector3f from(p.x(), p.y(), static_cast<float>(plan.ground(p.x(), p.y())));
      const Vector3f to(q.x(), q.y(), static_cast<float>(plan.ground(q.x(), q.y())));
      const float pitch = std::atan2(to.z() - from.z(), kPiece_m);
      Eigen::Isometry3f T = standing_at(from, std::atan2(along.y(), along.x()));
      T.rotate(Eigen::AngleAxisf(-pitch, Vector3f::UnitY()));
      scene.at(T).add(add_wire_fence, kPiece_m, 2.3F);
    }
    const Vector2f inside = 0.955F * a;
    site.stand(inside, static_cast<float>(i) * 0.5F * kPi, 2.2F, tower, random);
  }
}

void add_camp_wood(Scene& scene, const CampPlan& plan, SeededRandom& random) {
  for (int i = 0; i < 260; ++i) {
    const float x = random.uniform(-150.0F, 150.0F);
    const float y = random.uniform(-126.0F, 126.0F);
    if (std::abs(x) < kCampHalfX_m + 4.0F && std::abs(y) < kCampHalfY_m + 4.0F) continue;
    const auto z = static_cast<float>(plan.ground(x, y));
    const auto frame = scene.at({x, y, z}, random.uniform(0.0F, 6.0F));
    if (random.chance(0.7)) {
      add_conifer(scene, random.uniform(5.0F, 11.0F), random);
    } else {
      add_tree(scene, {.height_m = random.uniform(6.0F, 10.0F), .leaves = 900, .leaf_m = 0.4F},
               random);
    }
  }
}

void add_camp_grass(Scene& scene, const CampPlan& plan, SeededRandom& random) {
  for (int i = 0; i < 14000; ++i) {
    const Vector2f p(random.uniform(-kCampHalfX_m, kCampHalfX_m),
                     random.uniform(-kCampHalfY_m, kCampHalfY_m));
    const float track = plan.distance_to_track(p);
    if (track < kTrackHalf_m - 0.2F || track > 12.0F) continue;
    scene.at({p.x(), p.y(), static_cast<float>(plan.ground(p.x(), p.y()))})
        .add(add_tuft, random.uniform(0.12F, 0.3F), random);
  }
}

void add_one_supply(Scene& scene, SeededRandom& random) {
  static constexpr Add kSupplies[] = {
      add_crates,    add_crates,
      add_barrels,   add_barrels,
      add_generator, add_water_tank,
      add_log_pile,  [](Scene& s, SeededRandom& r) { add_sandbags(s, 3.0F, r); }};
  random.pick(kSupplies)(scene, random);
}

/// Draws places in the camp until `count` objects have a place.
void scatter(CampSite& site, int count, float radius_m, bool tilted, SeededRandom& random,
             Add add) {
  for (int tries = 0; count > 0 && tries < 6000; ++tries) {
    const float x = random.uniform(-kCampHalfX_m + 3.0F, kCampHalfX_m - 3.0F);
    const float y = random.uniform(-kCampHalfY_m + 3.0F, kCampHalfY_m - 3.0F);
    const float yaw = random.uniform(0.0F, 2.0F * kPi);
    const bool stands = tilted ? site.lie({x, y}, yaw, radius_m, add, random)
                               : site.stand({x, y}, yaw, radius_m, add, random);
    if (stands) --count;
  }
}

/// Kinds of objects beside a track, with equal probability.
enum class Facing : std::uint8_t { kTrack, kAlong, kAnywhere };
struct TrackThing {
  float from_middle_m;
  float radius_m;
  Facing facing;
  bool tilted;
  Add add;
};
constexpr TrackThing kTrackThings[] = {
    {6.2F, 1.6F, Facing::kTrack, true, add_one_supply},
    {6.2F, 1.6F, Facing::kTrack, true, add_one_supply},
    {6.0F, 1.6F, Facing::kTrack, true, [](Scene& s, SeededRandom&) { add_barrier(s); }},
    {5.2F, 0.6F, Facing::kAnywhere, false, add_person},
    {5.6F, 1.2F, Facing::kTrack, false, add_notice_board},
    {6.8F, 2.3F, Facing::kAlong, true, add_army_jeep},
    {8.0F, 3.4F, Facing::kAlong, true, add_army_truck},
    {7.7F, 3.3F, Facing::kTrack, true, add_container},
    {7.7F, 3.3F, Facing::kTrack, true, add_container},
    {9.0F, 4.4F, Facing::kTrack, false,
     [](Scene& s, SeededRandom& r) {
       s.at({0.0F, -3.0F, 0.0F}).add(add_house_tent, 6.0F, r.chance(0.5) ? kSand : kOlive, r);
     }},
    {5.0F, 0.5F, Facing::kTrack, false, [](Scene& s, SeededRandom&) { add_floodlight(s); }},
    {6.4F, 1.2F, Facing::kAnywhere, false,
     [](Scene& s, SeededRandom& r) { add_tree(s, {.height_m = r.uniform(5.0F, 8.0F)}, r); }},
    {5.8F, 1.0F, Facing::kAnywhere, false,
     [](Scene& s, SeededRandom& r) { add_bush(s, r.uniform(0.6F, 1.0F), r); }},
    {5.4F, 0.8F, Facing::kAnywhere, true,
     [](Scene& s, SeededRandom& r) { add_rock(s, r.uniform(0.6F, 1.5F), r); }},
};

/// One thing beside a track. `out` points away from the track's `middle`.
void add_beside_track(CampSite& site, const Vector2f& middle, const Vector2f& out,
                      SeededRandom& random) {
  const float facing = std::atan2(out.y(), out.x()) - 0.5F * kPi;
  const float any = random.uniform(0.0F, 2.0F * kPi);
  const TrackThing& thing = random.pick(kTrackThings);
  const float yaw = thing.facing == Facing::kTrack   ? facing
                    : thing.facing == Facing::kAlong ? facing + 0.5F * kPi
                                                     : any;
  const Vector2f at = middle + thing.from_middle_m * out;
  if (thing.tilted)
    site.lie(at, yaw, thing.radius_m, thing.add, random);
  else
    site.stand(at, yaw, thing.radius_m, thing.add, random);
}

/// Places things along both edges of every track, where the robots pass.
void add_along_tracks(CampSite& site, const CampPlan& plan, SeededRandom& random) {
  constexpr int kTries = 4;
  for (const Track& track : plan.tracks()) {
    for (std::size_t i = 0; i + 1 < track.size(); ++i) {
      const Vector2f piece = track[i + 1] - track[i];
      const Vector2f right = Vector2f(piece.y(), -piece.x()).normalized();
      for (int k = 0; k < kTries; ++k) {
        const float share = random.uniform(0.0F, 1.0F);
        const float side = random.sign();
        add_beside_track(site, track[i] + share * piece, side * right, random);
      }
    }
  }
}

}  // namespace

World make_camp(std::uint64_t seed) {
  const CampPlan plan(seed);
  Scene scene(seed);
  SeededRandom random = SeededRandom::stream(seed, 61);
  add_camp_ground(scene, plan, seed);
  CampSite site(scene, plan);
  add_yards(site, plan, seed);
  add_perimeter(scene, plan, site, random);
  add_along_tracks(site, plan, random);
  scatter(site, 60, 1.8F, true, random, add_one_supply);
  scatter(site, 8, 1.0F, false, random, add_toilet_cabin);
  scatter(site, 40, 0.7F, false, random, add_person);
  scatter(site, 70, 0.9F, true, random,
          [](Scene& s, SeededRandom& r) { add_rock(s, r.uniform(0.4F, 1.4F), r); });
  scatter(site, 45, 1.3F, false, random,
          [](Scene& s, SeededRandom& r) { add_tree(s, {.height_m = r.uniform(5.0F, 8.5F)}, r); });
  scatter(site, 40, 1.2F, false, random,
          [](Scene& s, SeededRandom& r) { add_bush(s, r.uniform(0.5F, 1.0F), r); });
  add_camp_wood(scene, plan, random);
  add_camp_grass(scene, plan, random);

  World world;
  world.name = "camp";
  scene.move_to(world);
  world.lighting.to_sun = Vector3f(0.5F, -0.45F, 0.75F).normalized();
  world.lighting.sun = 0.8F;
  world.lighting.ambient = 0.32F;
  world.lighting.haze_distance_m = 700.0F;
  world.routes = plan.routes();
  world.ground_height = [plan](double x, double y) { return plan.ground(x, y); };
  return world;
}

}  // namespace km
