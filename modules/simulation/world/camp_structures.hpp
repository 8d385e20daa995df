#pragma once

#include "modules/simulation/world/scene.hpp"

namespace km {

/// A guard's post of timber, 6 m tall.
void add_watch_tower(Scene& scene);
/// A mast with two floodlights that face -y.
void add_floodlight(Scene& scene);
void add_flag_pole(Scene& scene, SeededRandom& random);
/// A board with writing on two posts.
void add_notice_board(Scene& scene, SeededRandom& random);

}  // namespace km
