#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Vector3f;

constexpr float kScale = 4.0F;
// The recorded flights begin on machines, some meters above the floor, and far from the middle.
const Vector3f kOffset(10.4F, 2.5F, -5.0F);

Vector3f in_hall(const Vector3f& in_room) {
  return kScale * in_room + kOffset;
}

}  // namespace

World make_hall(std::uint64_t seed) {
  World world = make_vicon_room(seed);
  world.name = "hall";
  for (Vector3f& vertex : world.mesh.vertices) vertex = in_hall(vertex);
  for (Eigen::Vector2f& uv : world.mesh.uv) uv *= kScale;  // textures keep their size
  for (Lighting::Lamp& lamp : world.lighting.lamps) {
    lamp.position = in_hall(lamp.position);
    lamp.intensity *= kScale * kScale;  // the light falls with the square of the distance
  }
  const auto corner = [](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(in_hall(p.cast<float>()).cast<double>());
  };
  world.flight_volume = {corner(world.flight_volume.min()), corner(world.flight_volume.max())};
  return world;
}

}  // namespace km
