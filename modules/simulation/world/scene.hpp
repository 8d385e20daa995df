#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "modules/simulation/world/materials.hpp"
#include "modules/simulation/world/mesh_builder.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// A world under construction. The functions that add an object to it share one convention: it
/// stands on the plane z = 0 at the origin of the builder's current frame, faces -y (vehicles: drive
/// along +x), and looks the same for equal arguments and an equal state of `random`.
struct Scene {
  explicit Scene(std::uint64_t seed) : library(seed) {}

  MeshBuilder mesh;
  MaterialLibrary library;

  [[nodiscard]] MaterialId paint(SurfaceClass label, Recipe recipe,
                                 const Eigen::Vector3f& tint = Eigen::Vector3f::Ones(),
                                 float scale = 1.0F, float specular = 0.0F) {
    return library.add(label, recipe, tint, scale, specular);
  }
  /// A colour without structure of its own.
  [[nodiscard]] MaterialId plain(SurfaceClass label, float red, float green, float blue,
                                 float specular = 0.0F) {
    return library.add(label, Recipe::kPlain, {red, green, blue}, 1.0F, specular);
  }
};

}  // namespace km
