#include <catch2/catch.hpp>
#include <set>

#include "modules/simulation/world/materials.hpp"

namespace km {

TEST_CASE("Equal requests share a material, and recipes share textures", "[simulation][texture]") {
  MaterialLibrary library(1);
  const Eigen::Vector3f red(0.8F, 0.1F, 0.1F);
  const std::uint16_t wall = library.add(SurfaceClass::kWall, Recipe::kCanvas);
  CHECK(library.add(SurfaceClass::kWall, Recipe::kCanvas) == wall);
  const std::uint16_t tent = library.add(SurfaceClass::kTent, Recipe::kCanvas, red, 0.5F);
  const std::uint16_t lamp =
      library.add(SurfaceClass::kCeiling, Recipe::kPlain, red, 1.0F, 0.25F, 3.0F);
  CHECK(std::set{wall, tent, lamp}.size() == 3);

  World world;
  library.move_to(world);
  REQUIRE(world.materials.size() == 3);
  CHECK(world.textures.size() == 4);  // canvas, its grain, plain, its flat detail
  const Material& material = world.materials[tent];
  CHECK(material.label == SurfaceClass::kTent);
  CHECK(material.tint == red);
  CHECK(material.base == world.materials[wall].base);
  CHECK(material.base_period_m == 0.5F * traits_of(Recipe::kCanvas).period_m);
  CHECK(material.detail_period_m == 0.5F * traits_of(Recipe::kCanvas).detail_period_m);
  CHECK(world.textures[material.base].size() == traits_of(Recipe::kCanvas).size);
  CHECK(world.materials[lamp].specular == 0.25F);
  CHECK(world.materials[lamp].glow == 3.0F);
  CHECK(library.add(SurfaceClass::kWall, Recipe::kCanvas) == 0);  // it starts anew
}

TEST_CASE("The palette of the built-in worlds names every class in a colour of its own",
          "[simulation][palette]") {
  const LabelPalette& palette = simulation_palette();
  CHECK(palette.classes().size() == static_cast<std::size_t>(SurfaceClass::kObject) + 1);
  CHECK(palette.entries().size() == palette.classes().size());
  REQUIRE(palette.find(0) != nullptr);
  CHECK(palette.find(0)->name == "unknown");
  CHECK(palette.find(static_cast<LabelId>(SurfaceClass::kCurtain))->name == "curtain");
}

}  // namespace km
