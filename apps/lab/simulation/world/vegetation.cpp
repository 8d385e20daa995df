#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Vector3f;
using enum Recipe;

constexpr SurfaceClass kPlantLabel = SurfaceClass::kVegetation;

MaterialId foliage(Scene& scene, SeededRandom& random) {
  const Vector3f tints[] = {{1.0F, 1.0F, 1.0F},
                            {0.8F, 0.95F, 0.75F},
                            {1.25F, 1.15F, 0.8F},
                            {0.75F, 0.85F, 0.9F},
                            {1.15F, 1.25F, 0.95F}};
  return scene.paint(kPlantLabel, kLeaves, random.pick(tints));
}

/// A limb that bends a little twice on its way; returns its end.
Vector3f add_limb(Scene& scene, const Vector3f& from, const Vector3f& along, float radius,
                  float end_radius, int segments, MaterialId bark, SeededRandom& random) {
  constexpr int kPieces = 3;
  const float wander = 0.06F * along.norm();
  Vector3f p = from;
  for (int i = 1; i <= kPieces; ++i) {
    const float share = static_cast<float>(i) / kPieces;
    const float before = static_cast<float>(i - 1) / kPieces;
    Vector3f next = from + share * along;
    next.x() += random.uniform(-wander, wander);
    next.y() += random.uniform(-wander, wander);
    scene.cylinder(p, next, radius + before * (end_radius - radius),
                   radius + share * (end_radius - radius), segments, bark, false);
    p = next;
  }
  return p;
}

}  // namespace

void add_tree(Scene& scene, const TreeShape& shape, SeededRandom& random) {
  const auto bark = scene.paint(kPlantLabel, kBark);
  const auto leaves = foliage(scene, random);
  const float trunk_radius = 0.016F * shape.height_m + 0.03F;
  const float crown_bottom = shape.clear_m;
  const float crown_half = 0.5F * (shape.height_m - crown_bottom);
  const Vector3f crown(0.0F, 0.0F, crown_bottom + crown_half);
  scene.cylinder({0, 0, -0.15F}, {0, 0, 0.25F}, 1.7F * trunk_radius, 1.05F * trunk_radius, 10, bark,
                 false);
  const Vector3f fork = add_limb(scene, {0, 0, 0.2F}, {0, 0, 0.9F * crown_bottom}, trunk_radius,
                                 0.75F * trunk_radius, 10, bark, random);
  const Vector3f top = add_limb(scene, fork, {0, 0, crown_half}, 0.7F * trunk_radius,
                                0.3F * trunk_radius, 7, bark, random);
  std::vector<Vector3f> tips = {top + Vector3f(0, 0, 0.3F * crown_half)};
  const int boughs = 6 + random.below(4);
  for (int i = 0; i < boughs; ++i) {
    const float angle =
        kTwoPi * (static_cast<float>(i) + random.uniform(0.0F, 0.6F)) / static_cast<float>(boughs);
    const float height = random.uniform(-0.45F, 0.55F);
    const float reach = 0.62F * shape.crown_radius_m * std::sqrt(1.0F - height * height);
    const Vector3f tip =
        crown + Vector3f(reach * std::cos(angle), reach * std::sin(angle), height * crown_half);
    const Vector3f from = fork + random.uniform(0.0F, 0.7F) * (top - fork);
    const Vector3f end = add_limb(scene, from, tip - from, 0.4F * trunk_radius,
                                  0.12F * trunk_radius, 5, bark, random);
    tips.push_back(end);
    const Vector3f middle = 0.5F * (from + end);
    const Vector3f twig = 0.4F * shape.crown_radius_m *
                          Vector3f(std::cos(angle + 0.9F), std::sin(angle + 0.9F), 0.4F);
    tips.push_back(
        add_limb(scene, middle, twig, 0.2F * trunk_radius, 0.08F * trunk_radius, 4, bark, random));
  }
  const int share = shape.leaves / static_cast<int>(tips.size());
  for (const Vector3f& tip : tips) {
    const float radius = 0.42F * shape.crown_radius_m * random.uniform(0.8F, 1.25F);
    const float flat = 0.75F * radius;
    const float z = std::max(tip.z(), crown_bottom + flat + shape.leaf_m);
    scene.leaf_cluster({tip.x(), tip.y(), z}, {radius, radius, flat}, share, shape.leaf_m, leaves,
                       random);
  }
}

void add_conifer(Scene& scene, float height_m, SeededRandom& random) {
  const auto bark = scene.paint(kPlantLabel, kBark, {0.8F, 0.75F, 0.7F});
  const auto needles = scene.paint(kPlantLabel, kLeaves, {0.55F, 0.7F, 0.65F}, 0.6F);
  scene.cylinder({0, 0, -0.2F}, {0, 0, 0.95F * height_m}, 0.03F * height_m, 0.02F, 8, bark, false);
  const int tiers = static_cast<int>(height_m / 0.42F);
  for (int tier = 0; tier < tiers; ++tier) {
    const float up = static_cast<float>(tier) / static_cast<float>(tiers);
    const float z = (0.12F + 0.86F * up) * height_m;
    const float reach = (1.0F - up) * 0.26F * height_m + 0.15F;
    const int branches = 7 + static_cast<int>(9.0F * (1.0F - up));
    for (int i = 0; i < branches; ++i) {
      const float angle = kTwoPi * (static_cast<float>(i) + random.uniform(0.0F, 0.8F)) /
                          static_cast<float>(branches);
      const float length = reach * random.uniform(0.75F, 1.15F);
      const Vector3f out(std::cos(angle), std::sin(angle), -0.32F);
      const Vector3f side(-std::sin(angle), std::cos(angle), 0.0F);
      const Vector3f root(0, 0, z + random.uniform(-0.15F, 0.15F));
      const float half = 0.24F * length + 0.08F;
      const Vector3f middle = root + 0.6F * length * out + Vector3f(0, 0, 0.06F * length);
      const Vector3f tip = root + length * out;
      scene.triangle(root, middle - half * side, middle, needles);
      scene.triangle(root, middle, middle + half * side, needles);
      scene.triangle(middle - half * side, tip, middle, needles);
      scene.triangle(middle, tip, middle + half * side, needles);
    }
  }
}

void add_bush(Scene& scene, float radius_m, SeededRandom& random) {
  const auto leaves = foliage(scene, random);
  const int lobes = 3 + random.below(3);
  for (int i = 0; i < lobes; ++i) {
    const float angle = random.uniform(0.0F, kTwoPi);
    const float r = radius_m * random.uniform(0.5F, 0.8F);
    const float out = radius_m - r;
    const Vector3f center(out * std::cos(angle), out * std::sin(angle), 0.8F * r);
    scene.ellipsoid(center, 0.72F * Vector3f(r, r, r), 10, leaves);
    scene.leaf_cluster(center, {r, r, r}, static_cast<int>(110.0F + 160.0F * r * r), 0.2F, leaves,
                       random);
  }
}

void add_hedge(Scene& scene, float length_m, float depth_m, float height_m, SeededRandom& random) {
  const auto leaves = scene.paint(kPlantLabel, kLeaves, {0.85F, 0.95F, 0.85F});
  scene.box({0.04F, 0.06F, -0.1F}, {length_m - 0.04F, depth_m - 0.06F, height_m - 0.05F}, leaves,
            kSidesNoBottom);
  const int pieces = std::max(1, static_cast<int>(length_m / 0.8F));
  const float half = 0.5F * length_m / static_cast<float>(pieces);
  for (int i = 0; i < pieces; ++i) {
    const float x = (2.0F * static_cast<float>(i) + 1.0F) * half;
    for (const float y : {0.06F, depth_m - 0.06F}) {
      scene.leaf_cluster({x, y, 0.5F * height_m}, {1.1F * half, 0.06F, 0.52F * height_m}, 45, 0.17F,
                         leaves, random);
    }
    scene.leaf_cluster({x, 0.5F * depth_m, height_m - 0.04F}, {1.1F * half, 0.5F * depth_m, 0.05F},
                       24, 0.17F, leaves, random);
  }
}

void add_tuft(Scene& scene, float height_m, SeededRandom& random) {
  const auto blades = scene.paint(kPlantLabel, kGrass, {1.0F, 1.0F, 0.9F});
  const int count = 9 + random.below(6);
  for (int i = 0; i < count; ++i) {
    const float angle = random.uniform(0.0F, kTwoPi);
    const float root = random.uniform(0.0F, 0.12F);
    const float lean = random.uniform(0.2F, 0.7F) * height_m;
    const float height = height_m * random.uniform(0.6F, 1.0F);
    const Vector3f out(std::cos(angle), std::sin(angle), 0.0F);
    const Vector3f side(-0.02F * out.y(), 0.02F * out.x(), 0.0F);
    const Vector3f base = root * out + Vector3f(0, 0, -0.03F);
    scene.triangle(base + side, base - side, base + lean * out + Vector3f(0, 0, height + 0.03F),
                   blades);
  }
}

}  // namespace km
