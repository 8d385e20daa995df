#include <array>
#include <cmath>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Vector3f;
using enum Recipe;

constexpr SurfaceClass kPersonLabel = SurfaceClass::kPerson;

struct Clothes {
  MaterialId skin = 0;
  MaterialId hair = 0;
  MaterialId coat = 0;
  MaterialId trousers = 0;
  MaterialId shoes = 0;
};

Clothes random_clothes(Scene& scene, SeededRandom& random) {
  const Vector3f skins[] = {
      {0.6F, 0.4F, 0.3F}, {0.45F, 0.28F, 0.19F}, {0.22F, 0.13F, 0.09F}, {0.66F, 0.47F, 0.37F}};
  const Vector3f cloths[] = {{0.5F, 0.06F, 0.06F},  {0.06F, 0.1F, 0.3F},  {0.65F, 0.63F, 0.58F},
                             {0.05F, 0.05F, 0.06F}, {0.1F, 0.25F, 0.14F}, {0.6F, 0.42F, 0.08F},
                             {0.3F, 0.3F, 0.32F},   {0.25F, 0.16F, 0.1F}, {0.2F, 0.35F, 0.5F}};
  const auto cloth = [&] { return scene.paint(kPersonLabel, kCanvas, random.pick(cloths), 0.3F); };
  Clothes clothes;
  clothes.skin = scene.plain(kPersonLabel, random.pick(skins));
  clothes.hair = random.chance(0.6) ? scene.plain(kPersonLabel, {0.04F, 0.03F, 0.025F})
                                    : scene.plain(kPersonLabel, {0.3F, 0.2F, 0.1F});
  clothes.coat = cloth();
  clothes.trousers = cloth();
  clothes.shoes = scene.plain(kPersonLabel, {0.05F, 0.04F, 0.035F});
  return clothes;
}

void add_leg(Scene& scene, float side, float stride, const Clothes& clothes) {
  const Vector3f hip(0.095F * side, 0.0F, 0.9F);
  const Vector3f knee(0.1F * side, -0.5F * stride - 0.02F, 0.48F);
  const Vector3f ankle(0.1F * side, -stride, 0.09F);
  scene.cylinder(hip, knee, 0.095F, 0.065F, 8, clothes.trousers, false);
  scene.cylinder(knee, ankle, 0.067F, 0.05F, 8, clothes.trousers, false);
  scene.ellipsoid(ankle + Vector3f(0.0F, -0.06F, -0.045F), {0.05F, 0.14F, 0.05F}, 6, clothes.shoes);
}

void add_arm(Scene& scene, float side, float swing, const Clothes& clothes) {
  const Vector3f shoulder(0.2F * side, 0.0F, 1.4F);
  const Vector3f elbow(0.26F * side, 0.4F * swing, 1.13F);
  const Vector3f wrist(0.24F * side, swing - 0.08F, 0.9F);
  scene.ellipsoid(shoulder, {0.075F, 0.075F, 0.075F}, 6, clothes.coat);
  scene.cylinder(shoulder, elbow, 0.06F, 0.048F, 7, clothes.coat, false);
  scene.cylinder(elbow, wrist, 0.048F, 0.036F, 7, clothes.coat, false);
  scene.ellipsoid(wrist, {0.04F, 0.045F, 0.06F}, 6, clothes.skin);
}

}  // namespace

void add_person(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const Clothes clothes = random_clothes(scene, random);
  const bool strides = random.chance(0.5);
  const float stride = strides ? random.uniform(0.12F, 0.25F) : 0.02F;
  const bool long_coat = random.chance(0.3);
  add_leg(scene, -1.0F, stride, clothes);
  add_leg(scene, 1.0F, -stride, clothes);
  add_arm(scene, -1.0F, stride, clothes);
  add_arm(scene, 1.0F, -stride, clothes);
  scene.ellipsoid({0.0F, 0.0F, 1.2F}, {0.195F, 0.125F, 0.32F}, 12, clothes.coat);
  scene.ellipsoid({0.0F, 0.0F, 0.95F}, {0.17F, 0.125F, 0.17F}, 10,
                  long_coat ? clothes.coat : clothes.trousers);
  if (long_coat)
    scene.cylinder({0.0F, 0.0F, 0.62F}, {0.0F, 0.0F, 1.0F}, 0.22F, 0.17F, 12, clothes.coat);
  scene.cylinder({0.0F, 0.0F, 1.44F}, {0.0F, 0.0F, 1.58F}, 0.055F, 0.05F, 8, clothes.skin, false);
  scene.ellipsoid({0.0F, -0.01F, 1.65F}, {0.078F, 0.098F, 0.115F}, 12, clothes.skin);
  scene.ellipsoid({0.0F, 0.02F, 1.69F}, {0.086F, 0.1F, 0.095F}, 10, clothes.hair);
  if (random.chance(0.35))  // a bag on the back
    scene.box({-0.15F, 0.1F, 1.0F}, {0.15F, 0.28F, 1.42F}, clothes.trousers);
}

}  // namespace km
