#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "modules/simulation/world/procedural_texture.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// Materials of a world under construction, by name. A texture is generated when the first material
/// needs it, so that a world pays only for the recipes it uses. Not thread-safe.
class MaterialLibrary {
 public:
  /// Different seeds give different textures of the same kinds.
  explicit MaterialLibrary(std::uint64_t seed) : seed_(seed) {}

  /// Index into World::materials of `recipe` with the recipe's natural periods times `scale`, its
  /// colours times `tint`. The same request twice gives the same index. Throws std::length_error
  /// beyond 65535 materials.
  [[nodiscard]] std::uint16_t add(SurfaceClass label, Recipe recipe,
                                  const Eigen::Vector3f& tint = Eigen::Vector3f::Ones(),
                                  float scale = 1.0F, float specular = 0.0F, float glow = 0.0F);

  /// Hands what was made to a world. The library is empty afterwards.
  void move_to(World& world);

 private:
  std::uint16_t texture(Recipe recipe);

  std::uint64_t seed_;
  std::vector<Material> materials_;
  std::vector<Texture> textures_;
  std::vector<Recipe> made_;  // of textures_, by index
};

}  // namespace km
