#pragma once

#include "apps/lab/simulation/world/canvas.hpp"

namespace km {

/// The recipes (see procedural_texture.hpp) of printed objects: signs, pictures, lines of text.
/// `size` is the edge in texels.
[[nodiscard]] Canvas play_mat(int size, SeededRandom& random);
[[nodiscard]] Canvas marker_tape(int size, SeededRandom& random);
[[nodiscard]] Canvas tag_grid(int size, SeededRandom& random);
[[nodiscard]] Canvas checker(int size, SeededRandom& random);
[[nodiscard]] Canvas posters(int size, SeededRandom& random);
[[nodiscard]] Canvas newsprint(int size, SeededRandom& random);

}  // namespace km
