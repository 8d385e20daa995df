#include "modules/simulation/world/materials.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace km {
namespace {

bool equal(const Material& a, const Material& b) {
  return a.label == b.label && a.tint == b.tint && a.base == b.base && a.detail == b.detail &&
         a.base_period_m == b.base_period_m && a.detail_period_m == b.detail_period_m &&
         a.specular == b.specular && a.glow == b.glow;
}

}  // namespace

std::uint16_t MaterialLibrary::add(SurfaceClass label, Recipe recipe, const Eigen::Vector3f& tint,
                                   float scale, float specular, float glow) {
  const RecipeTraits& traits = traits_of(recipe);
  Material material;
  material.label = label;
  material.tint = tint;
  material.base = texture(recipe);
  material.detail = texture(traits.detail);
  material.base_period_m = scale * traits.period_m;
  material.detail_period_m = scale * traits.detail_period_m;
  material.specular = specular;
  material.glow = glow;

  const auto known = std::find_if(materials_.begin(), materials_.end(),
                                  [&](const Material& other) { return equal(other, material); });
  const auto index = static_cast<std::size_t>(known - materials_.begin());
  if (index > std::numeric_limits<std::uint16_t>::max()) {
    throw std::length_error("a world has at most 65535 materials");
  }
  if (known == materials_.end()) materials_.push_back(material);
  return static_cast<std::uint16_t>(index);
}

void MaterialLibrary::move_to(World& world) {
  world.materials = std::exchange(materials_, {});
  world.textures = std::exchange(textures_, {});
  made_.clear();
}

std::uint16_t MaterialLibrary::texture(Recipe recipe) {
  const auto known = std::find(made_.begin(), made_.end(), recipe);
  const auto index = static_cast<std::uint16_t>(known - made_.begin());
  if (known == made_.end()) {
    textures_.push_back(make_texture(recipe, seed_));
    made_.push_back(recipe);
  }
  return index;
}

}  // namespace km
