#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/terrain.hpp"

namespace km {
namespace {

using Eigen::Vector3f;
using enum Recipe;

constexpr SurfaceClass kPlantLabel = SurfaceClass::kVegetation;

MaterialId foliage(Scene& scene, SeededRandom& random) {
  const Vector3f tints[] = {
      {1.0F, 1.0F, 1.0F}, {0.8F, 0.95F, 0.75F}, {1.25F, 1.15F, 0.8F}, {0.75F, 0.85F, 0.9F}};
  return scene.paint(kPlantLabel, kLeaves, random.pick(tints));
}

Vector3f towards(float angle, float up) {
  return {std::cos(angle), std::sin(angle), up};
}

}  // namespace

void add_tree(Scene& scene, float height_m, SeededRandom& random) {
  constexpr float kClear_m = 2.8F;
  constexpr float kLeaf_m = 0.36F;
  constexpr int kLeavesOfTree = 1300;
  const auto bark = scene.paint(kPlantLabel, kBark);
  const auto leaves = foliage(scene, random);
  const float trunk = 0.016F * height_m + 0.03F;
  const float reach = 0.3F * height_m;
  const float half = 0.5F * (height_m - kClear_m);
  const Vector3f root(0.0F, 0.0F, -0.15F);
  const float lean = random.uniform(-0.2F, 0.2F);
  const Vector3f fork(lean, random.uniform(-0.2F, 0.2F), kClear_m);
  const Vector3f top = fork + Vector3f(0.0F, 0.0F, half);
  scene.cylinder(root, fork, 1.3F * trunk, 0.75F * trunk, 10, bark, false);
  scene.cylinder(fork, top, 0.7F * trunk, 0.3F * trunk, 7, bark, false);
  std::vector<Vector3f> tips = {top + Vector3f(0.0F, 0.0F, 0.3F * half)};
  const int boughs = 10 + random.below(5);
  for (int i = 0; i < boughs; ++i) {
    const float angle =
        kTwoPi * (static_cast<float>(i) + random.uniform(0.0F, 0.6F)) / static_cast<float>(boughs);
    const Vector3f from = fork + random.uniform(0.0F, 0.7F) * (top - fork);
    const float out = reach * random.uniform(0.4F, 0.7F);
    const float up = half * random.uniform(0.4F, 1.5F);
    const Vector3f tip = fork + out * towards(angle, 0.0F) + Vector3f(0.0F, 0.0F, up);
    scene.cylinder(from, tip, 0.35F * trunk, 0.1F * trunk, 5, bark, false);
    tips.push_back(tip);
  }
  for (const Vector3f& tip : tips) {
    const float radius = 0.42F * reach * random.uniform(0.8F, 1.25F);
    const float z = std::max(tip.z(), kClear_m + 0.75F * radius + kLeaf_m);
    scene.leaf_cluster({tip.x(), tip.y(), z}, {radius, radius, 0.75F * radius},
                       kLeavesOfTree / static_cast<int>(tips.size()), kLeaf_m, leaves, random);
  }
}

void add_conifer(Scene& scene, float height_m, SeededRandom& random) {
  const auto bark = scene.paint(kPlantLabel, kBark, {0.8F, 0.75F, 0.7F});
  const auto needles = scene.paint(kPlantLabel, kLeaves, {0.55F, 0.7F, 0.65F}, 0.6F);
  scene.cylinder({0, 0, -0.2F}, {0, 0, 0.95F * height_m}, 0.03F * height_m, 0.02F, 8, bark, false);
  const int tiers = static_cast<int>(height_m / 0.42F);
  for (int tier = 0; tier < tiers; ++tier) {
    const float up = static_cast<float>(tier) / static_cast<float>(tiers);
    const int branches = 7 + static_cast<int>(9.0F * (1.0F - up));
    for (int i = 0; i < branches; ++i) {
      const float angle = kTwoPi * (static_cast<float>(i) + random.uniform(0.0F, 0.8F)) /
                          static_cast<float>(branches);
      const float length = ((1.0F - up) * 0.26F * height_m + 0.15F) * random.uniform(0.75F, 1.15F);
      const Vector3f side = (0.24F * length + 0.08F) * towards(angle + 0.5F * kPi, 0.0F);
      const Vector3f root(0, 0, (0.12F + 0.86F * up) * height_m + random.uniform(-0.15F, 0.15F));
      const Vector3f middle = root + 0.6F * length * towards(angle, -0.22F);
      const Vector3f tip = root + length * towards(angle, -0.32F);
      scene.triangle(root, middle - side, middle, needles);
      scene.triangle(root, middle, middle + side, needles);
      scene.triangle(middle - side, tip, middle, needles);
      scene.triangle(middle, tip, middle + side, needles);
    }
  }
}

void add_bush(Scene& scene, float radius_m, SeededRandom& random) {
  const auto leaves = foliage(scene, random);
  const int lobes = 3 + random.below(3);
  for (int i = 0; i < lobes; ++i) {
    const float r = radius_m * random.uniform(0.5F, 0.8F);
    const Vector3f center = (radius_m - r) * towards(random.uniform(0.0F, kTwoPi), 0.0F) +
                            Vector3f(0.0F, 0.0F, 0.8F * r);
    scene.ellipsoid(center, 0.72F * Vector3f(r, r, r), 10, leaves);
    scene.leaf_cluster(center, {r, r, r}, static_cast<int>(110.0F + 160.0F * r * r), 0.2F, leaves,
                       random);
  }
}

void add_hedge(Scene& scene, float length_m, float height_m, SeededRandom& random) {
  const auto leaves = scene.paint(kPlantLabel, kLeaves, {0.85F, 0.95F, 0.85F});
  scene.box({0.04F, 0.06F, -0.1F}, {length_m - 0.04F, 0.7F, height_m}, leaves, kSidesNoBottom);
  for (float x = 0.4F; x < length_m; x += 0.8F)
    scene.leaf_cluster({x, 0.38F, 0.5F * height_m}, {0.5F, 0.38F, 0.55F * height_m}, 120, 0.17F,
                       leaves, random);
}

void add_tuft(Scene& scene, float height_m, SeededRandom& random) {
  const auto blades = scene.paint(kPlantLabel, kGrass, {1.0F, 1.0F, 0.9F});
  const int count = 9 + random.below(6);
  for (int i = 0; i < count; ++i) {
    const float angle = random.uniform(0.0F, kTwoPi);
    const Vector3f out = towards(angle, 0.0F);
    const Vector3f side = 0.02F * towards(angle - 0.5F * kPi, 0.0F);
    const Vector3f base = random.uniform(0.0F, 0.12F) * out - Vector3f(0, 0, 0.03F);
    const float lean = height_m * random.uniform(0.2F, 0.7F);
    const float up = height_m * random.uniform(0.6F, 1.0F);
    const Vector3f tip = base + lean * out + Vector3f(0, 0, up + 0.03F);
    scene.triangle(base + side, base - side, tip, blades);
  }
}

void add_rock(Scene& scene, float size_m, SeededRandom& random) {
  const auto stone = scene.paint(SurfaceClass::kTerrain, kConcrete, {0.7F, 0.68F, 0.64F}, 0.37F);
  const auto seed = static_cast<std::uint64_t>(random.below(1 << 30));
  const float length = random.uniform(0.4F, 0.6F);
  const float width = random.uniform(0.35F, 0.5F);
  const Vector3f radii = size_m * Vector3f(length, width, random.uniform(0.25F, 0.45F));
  constexpr int kRows = 8;
  constexpr int kColumns = 14;
  const auto point = [&](float row, int column) {
    const float latitude = kPi * (row / kRows - 0.5F);
    const float angle = kTwoPi * static_cast<float>(column % kColumns) / kColumns;
    const Vector3f unit(std::cos(latitude) * std::cos(angle), std::cos(latitude) * std::sin(angle),
                        std::sin(latitude));
    const Vector3f lumps = 3.0F * unit;
    const float radius = 1.0F + 0.22F * ground_noise(lumps.x() + lumps.z(), lumps.y(), 1.3F, seed);
    return Vector3f(radius * radii.cwiseProduct(unit));
  };
  scene.sheet(kRows, kColumns, point, stone);
}

}  // namespace km
