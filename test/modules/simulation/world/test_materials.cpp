#include <catch2/catch.hpp>
#include <set>

#include "modules/simulation/world/procedural_texture.hpp"

namespace km {

TEST_CASE("Recipes are numbered without gaps", "[simulation][texture]") {
  CHECK(kRecipeCount == 31);
}

}  // namespace km
