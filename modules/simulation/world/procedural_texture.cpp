#include "modules/simulation/world/procedural_texture.hpp"

#include <array>
#include <stdexcept>

#include "modules/simulation/world/recipes.hpp"

namespace km {
namespace {

using Make = Canvas (*)(int size, SeededRandom& random);

struct Entry {
  RecipeTraits traits;
  Make make;
};

constexpr Recipe kFlat = Recipe::kDetailFlat;
constexpr Recipe kGrain = Recipe::kDetailGrain;
constexpr Recipe kStains = Recipe::kDetailStains;

// Recipe, name, size, period, detail, period of the detail. The two periods have no common multiple
// below some dozens of either.
constexpr std::array<Entry, kRecipeCount> kEntries = {{
    {{Recipe::kPlain, "plain", 256, 2.0F, kFlat, 1.0F}, recipes::plain},
    {{Recipe::kAsphalt, "asphalt", 1024, 4.0F, kStains, 9.31F}, recipes::asphalt},
    {{Recipe::kConcrete, "concrete", 512, 4.0F, kGrain, 0.83F}, recipes::concrete},
    {{Recipe::kPavers, "pavers", 512, 4.0F, kGrain, 0.83F}, recipes::pavers},
    {{Recipe::kPlaster, "plaster", 512, 4.0F, kGrain, 0.77F}, recipes::plaster},
    {{Recipe::kBrick, "brick", 512, 1.2F, kStains, 5.93F}, recipes::brick},
    {{Recipe::kStoneBlocks, "stone_blocks", 512, 3.0F, kGrain, 0.71F}, recipes::stone_blocks},
    {{Recipe::kRoofTiles, "roof_tiles", 512, 2.0F, kStains, 6.37F}, recipes::roof_tiles},
    {{Recipe::kGrass, "grass", 1024, 4.0F, kStains, 11.7F}, recipes::grass},
    {{Recipe::kSoil, "soil", 512, 6.0F, kGrain, 0.97F}, recipes::soil},
    {{Recipe::kGravel, "gravel", 512, 2.0F, kStains, 7.19F}, recipes::gravel},
    {{Recipe::kBark, "bark", 512, 1.0F, kStains, 2.83F}, recipes::bark},
    {{Recipe::kLeaves, "leaves", 512, 2.0F, kStains, 5.37F}, recipes::leaves},
    {{Recipe::kPaintedMetal, "painted_metal", 512, 2.0F, kGrain, 0.61F}, recipes::painted_metal},
    {{Recipe::kCorrugatedMetal, "corrugated_metal", 512, 2.0F, kStains, 5.71F},
     recipes::corrugated_metal},
    {{Recipe::kCanvas, "canvas", 512, 2.0F, kGrain, 0.37F}, recipes::canvas_cloth},
    {{Recipe::kWoodPlanks, "wood_planks", 1024, 2.0F, kStains, 3.41F}, recipes::wood_planks},
    {{Recipe::kMat, "mat", 512, 2.0F, kStains, 5.23F}, recipes::foam_mat},
    {{Recipe::kCarpet, "carpet", 512, 2.0F, kFlat, 1.0F}, recipes::carpet},
    {{Recipe::kCurtain, "curtain", 512, 2.0F, kGrain, 0.43F}, recipes::curtain},
    {{Recipe::kWallpaper, "wallpaper", 512, 1.0F, kStains, 3.77F}, recipes::wallpaper},
    {{Recipe::kMattress, "mattress", 512, 2.0F, kFlat, 1.0F}, recipes::mattress},
    {{Recipe::kPlayMat, "play_mat", 1024, 2.0F, kStains, 3.13F}, recipes::play_mat},
    {{Recipe::kMarkerTape, "marker_tape", 1024, 2.0F, kGrain, 0.59F}, recipes::marker_tape},
    {{Recipe::kTagGrid, "tag_grid", 512, 1.0F, kFlat, 1.0F}, recipes::tag_grid},
    {{Recipe::kChecker, "checker", 256, 1.0F, kFlat, 1.0F}, recipes::checker},
    {{Recipe::kPosters, "posters", 1024, 4.0F, kGrain, 0.91F}, recipes::posters},
    {{Recipe::kNewsprint, "newsprint", 1024, 1.0F, kStains, 2.17F}, recipes::newsprint},
    {{Recipe::kDetailFlat, "detail_flat", 1, 1.0F, kFlat, 1.0F}, recipes::detail_flat},
    {{Recipe::kDetailGrain, "detail_grain", 512, 1.0F, kFlat, 1.0F}, recipes::detail_grain},
    {{Recipe::kDetailStains, "detail_stains", 512, 1.0F, kFlat, 1.0F}, recipes::detail_stains},
}};

const Entry& entry_of(Recipe recipe) {
  const auto index = static_cast<std::size_t>(recipe);
  if (index >= kEntries.size()) {
    throw std::invalid_argument("no recipe has number " + std::to_string(index));
  }
  return kEntries[index];
}

}  // namespace

const RecipeTraits& traits_of(Recipe recipe) {
  return entry_of(recipe).traits;
}

Texture make_texture(Recipe recipe, std::uint64_t seed) {
  const Entry& entry = entry_of(recipe);
  SeededRandom random = SeededRandom::stream(seed, static_cast<std::uint64_t>(recipe));
  const int size = entry.traits.size;
  return Texture(size, entry.make(size, random).take());
}

}  // namespace km
