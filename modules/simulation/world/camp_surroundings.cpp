#include "modules/simulation/world/camp_surroundings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "modules/simulation/world/camp_structures.hpp"
#include "modules/simulation/world/street_furniture.hpp"
#include "modules/simulation/world/vegetation.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kSharpBorders_m = 10.0F;  // from a track; beyond, cells have one cover each

/// What covers the ground at a point: track, trodden earth or grass, with frayed borders.
class GroundPaint {
 public:
  GroundPaint(Scene& scene, const CampPlan& plan, std::uint64_t seed)
      : plan_(plan),
        seed_(seed),
        grass_(scene.paint(SurfaceClass::kTerrain, Recipe::kGrass)),
        bare_(scene.paint(SurfaceClass::kTerrain, Recipe::kSoil, {1.05F, 1.0F, 0.85F})),
        track_(scene.paint(SurfaceClass::kRoad, Recipe::kSoil)) {}

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
  scene.mesh.grid(
      kParts, kParts,
      [&](int i, int j) {
        const Vector2f p = at(static_cast<float>(i), static_cast<float>(j));
        const float s = static_cast<float>(j) / kParts;
        const float t = static_cast<float>(i) / kParts;
        const Vector3f normal = (1.0F - t) * ((1.0F - s) * field.normal(row, column) +
                                              s * field.normal(row, column + 1)) +
                                t * ((1.0F - s) * field.normal(row + 1, column) +
                                     s * field.normal(row + 1, column + 1));
        const auto z = static_cast<float>(field.at(p.x(), p.y()));
        return MeshBuilder::GridPoint{{p.x(), p.y(), z}, normal, p};
      },
      [&](int i, int j) {
        return paint(at(static_cast<float>(i) + 0.5F, static_cast<float>(j) + 0.5F));
      });
}

}  // namespace

void add_camp_ground(Scene& scene, const CampPlan& plan, std::uint64_t seed) {
  const GroundPaint paint(scene, plan, seed);
  const Heightfield& near = plan.near_ground();
  const auto corners_of = [&](int row, int column) {
    std::array<Vector2f, 4> corners;
    for (int i = 0; i < 4; ++i) {
      corners[static_cast<std::size_t>(i)] = near.point(row + i / 2, column + i % 2).head<2>();
    }
    return corners;
  };
  std::vector<std::array<int, 2>> borders;
  scene.mesh.grid(
      near.rows(), near.columns(),
      [&](int row, int column) {
        const Vector3f p = near.point(row, column);
        return MeshBuilder::GridPoint{p, near.normal(row, column), p.head<2>()};
      },
      [&](int row, int column) -> std::optional<MaterialId> {
        const auto corners = corners_of(row, column);
        const MaterialId first = paint(corners[0]);
        if (plan.distance_to_track(corners[0]) > kSharpBorders_m) return first;
        if (std::ranges::all_of(corners, [&](const Vector2f& p) { return paint(p) == first; })) {
          return first;
        }
        borders.push_back({row, column});
        return std::nullopt;
      });
  for (const auto& [row, column] : borders) add_border_cell(scene, near, row, column, paint);
  const MaterialId meadow =
      scene.paint(SurfaceClass::kTerrain, Recipe::kGrass, {1.0F, 1.0F, 0.9F}, 2.7F);
  const Heightfield& far = plan.far_ground();
  scene.mesh.sheet(
      far.rows(), far.columns(), [&](int row, int column) { return far.point(row, column); },
      [&](int row, int column) -> std::optional<MaterialId> {
        const Vector3f middle = 0.5F * (far.point(row, column) + far.point(row + 1, column + 1));
        if (near.contains(middle.x(), middle.y())) return std::nullopt;
        return meadow;
      },
      true);
}

void add_perimeter(Scene& scene, const CampPlan& plan, CampSite& site) {
  const std::array<Vector2f, 4> corners = {{{-kCampHalfX_m, -kCampHalfY_m},
                                            {kCampHalfX_m, -kCampHalfY_m},
                                            {kCampHalfX_m, kCampHalfY_m},
                                            {-kCampHalfX_m, kCampHalfY_m}}};
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
      const ScopedFrame frame(scene.mesh, T);
      add_wire_fence(scene, kPiece_m, 2.3F);
    }
    const Vector2f inside = 0.955F * a;
    site.stand(inside, static_cast<float>(i) * 0.5F * kPi, 2.2F, [&] { add_watch_tower(scene); });
  }
}

void add_camp_wood(Scene& scene, const CampPlan& plan, SeededRandom& random) {
  for (int i = 0; i < 260; ++i) {
    const float x = random.uniform(-150.0F, 150.0F);
    const float y = random.uniform(-126.0F, 126.0F);
    if (std::abs(x) < kCampHalfX_m + 4.0F && std::abs(y) < kCampHalfY_m + 4.0F) continue;
    const auto z = static_cast<float>(plan.ground(x, y));
    const ScopedFrame frame(scene.mesh, standing_at({x, y, z}, random.uniform(0.0F, 6.0F)));
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
    const ScopedFrame frame(
        scene.mesh,
        standing_at({p.x(), p.y(), static_cast<float>(plan.ground(p.x(), p.y()))}, 0.0F));
    add_tuft(scene, random.uniform(0.12F, 0.3F), random);
  }
}

}  // namespace km
