#pragma once

#include <cstdint>

#include "apps/lab/simulation/world/texture.hpp"

namespace km {

/// Available textures. Colours are the material's own linear albedo, so that a tint of one looks
/// natural. Recipes of painted or dyed materials are near white and take any tint; they are marked
/// (painted). In brackets: edge of one tile at the natural scale.
enum class Recipe : std::uint8_t {
  kPlain,            ///< (painted) Smooth paint: no structure of its own [2 m].
  kAsphalt,          ///< Grey with grains, stains, cracks and patches [4 m].
  kConcrete,         ///< Cast slabs: blotches, pores, joints every 2 m [4 m].
  kPavers,           ///< Sidewalk slabs of 0.5 m with joints [4 m].
  kPlaster,          ///< (painted) Rough render with stains [4 m].
  kBrick,            ///< Running bond, 16 courses a tile [1.2 m].
  kStoneBlocks,      ///< Ashlar of irregular lengths [3 m].
  kRoofTiles,        ///< Overlapping rows of clay tiles; v points up the roof [2 m].
  kGrass,            ///< Blades and bare spots [4 m].
  kSoil,             ///< Earth with clods, stones and wheel marks [6 m].
  kGravel,           ///< Pebbles of 2 to 8 cm [2 m].
  kBark,             ///< Furrows along v [1 m].
  kLeaves,           ///< Foliage seen from outside, dark gaps between lit leaves [2 m].
  kPaintedMetal,     ///< (painted) Clean paint with scratches, dirt and seams [2 m].
  kCorrugatedMetal,  ///< (painted) Ribs along v every 0.1 m, rust runs [2 m].
  kCanvas,           ///< (painted) Tent cloth: weave, creases, seams every 1 m [2 m].
  kWoodPlanks,       ///< Boards along u, 0.125 m wide, with grain and nails [2 m].
  kCarpet,           ///< (painted) Woven floor with flecks [2 m].
  kCurtain,          ///< (painted) Hanging cloth: vertical creases, weave [2 m].
  kMattress,         ///< (painted) Covered foam: fine weave, creases [2 m].
  kPlayMat,          ///< Printed carpet: a toy town with roads and houses [2 m].
  kMarkerTape,  ///< Black strip along u with white marks; sixteen different strips above each other
                ///< [2 m].
  kTagGrid,     ///< Square fiducial marks, 6 by 6 [1 m].
  kChecker,     ///< Black and white squares, 8 by 8 [1 m].
  kPosters,     ///< Sixteen different prints, 4 by 4, each a quarter of the tile [4 m].
  kNewsprint,   ///< Lines of text and pictures, black on white [1 m].
  kDetailFlat,  ///< Mid-grey: a detail that does nothing [1 m].
  kDetailGrain,   ///< Fine many-octave noise around mid-grey [1 m].
  kDetailStains,  ///< Soft blotches and streaks around mid-grey [1 m].
};
inline constexpr int kRecipeCount = static_cast<int>(Recipe::kDetailStains) + 1;

/// Fixed properties of a recipe.
struct RecipeTraits {
  Recipe recipe = Recipe::kPlain;
  const char* name = "";
  int size = 512;                        ///< Texels on an edge.
  float period_m = 1.0F;                 ///< Natural edge of one tile [m].
  Recipe detail = Recipe::kDetailGrain;  ///< Recipe of the detail on top.
  float detail_period_m = 1.0F;          ///< Incommensurate with period_m [m].
};
[[nodiscard]] const RecipeTraits& traits_of(Recipe recipe);

/// A seamless texture; a function of its arguments alone.
[[nodiscard]] Texture make_texture(Recipe recipe, std::uint64_t seed);

}  // namespace km
