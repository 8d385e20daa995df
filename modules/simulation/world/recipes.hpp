#pragma once

#include "modules/simulation/world/canvas.hpp"
#include "modules/simulation/world/seeded_random.hpp"

namespace km::recipes {

// One function per Recipe (procedural_texture.hpp says what each looks like). `size` is a power of
// two, at least 64; the tile covers the recipe's period.

// Ground: recipes_ground.cpp.
[[nodiscard]] Canvas asphalt(int size, SeededRandom& random);
[[nodiscard]] Canvas concrete(int size, SeededRandom& random);
[[nodiscard]] Canvas pavers(int size, SeededRandom& random);
[[nodiscard]] Canvas grass(int size, SeededRandom& random);
[[nodiscard]] Canvas soil(int size, SeededRandom& random);
[[nodiscard]] Canvas gravel(int size, SeededRandom& random);

// Walls, roofs and plants: recipes_masonry.cpp.
[[nodiscard]] Canvas plaster(int size, SeededRandom& random);
[[nodiscard]] Canvas brick(int size, SeededRandom& random);
[[nodiscard]] Canvas stone_blocks(int size, SeededRandom& random);
[[nodiscard]] Canvas roof_tiles(int size, SeededRandom& random);
[[nodiscard]] Canvas bark(int size, SeededRandom& random);
[[nodiscard]] Canvas leaves(int size, SeededRandom& random);

// Metal, wood and cloth: recipes_cloth.cpp.
[[nodiscard]] Canvas plain(int size, SeededRandom& random);
[[nodiscard]] Canvas painted_metal(int size, SeededRandom& random);
[[nodiscard]] Canvas corrugated_metal(int size, SeededRandom& random);
[[nodiscard]] Canvas wood_planks(int size, SeededRandom& random);
[[nodiscard]] Canvas canvas_cloth(int size, SeededRandom& random);
[[nodiscard]] Canvas foam_mat(int size, SeededRandom& random);
[[nodiscard]] Canvas carpet(int size, SeededRandom& random);
[[nodiscard]] Canvas curtain(int size, SeededRandom& random);
[[nodiscard]] Canvas mattress(int size, SeededRandom& random);

// Prints and details: recipes_print.cpp.
[[nodiscard]] Canvas wallpaper(int size, SeededRandom& random);
[[nodiscard]] Canvas play_mat(int size, SeededRandom& random);
[[nodiscard]] Canvas marker_tape(int size, SeededRandom& random);
[[nodiscard]] Canvas tag_grid(int size, SeededRandom& random);
[[nodiscard]] Canvas checker(int size, SeededRandom& random);
[[nodiscard]] Canvas posters(int size, SeededRandom& random);
[[nodiscard]] Canvas newsprint(int size, SeededRandom& random);
[[nodiscard]] Canvas detail_flat(int size, SeededRandom& random);
[[nodiscard]] Canvas detail_grain(int size, SeededRandom& random);
[[nodiscard]] Canvas detail_stains(int size, SeededRandom& random);

}  // namespace km::recipes
