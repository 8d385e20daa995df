#pragma once

#include "modules/simulation/world/scene.hpp"

namespace km {

/// A lamp post, 5.5 m tall, its arm towards -y.
void add_street_lamp(Scene& scene, SeededRandom& random);

/// A traffic sign on a pole: disc, triangle, square or a street's name, facing -y.
void add_traffic_sign(Scene& scene, SeededRandom& random);

/// A traffic light with a pole at the kerb, facing -y.
void add_traffic_light(Scene& scene);

void add_bench(Scene& scene);
void add_bin(Scene& scene, SeededRandom& random);
void add_bollard(Scene& scene);
void add_hydrant(Scene& scene);
void add_mail_box(Scene& scene, SeededRandom& random);
/// A round pillar with prints all around.
void add_advertising_column(Scene& scene, SeededRandom& random);
void add_planter(Scene& scene, SeededRandom& random);

/// Fences from x = 0 to `length_m` along y = 0.
void add_railing(Scene& scene, float length_m, float height_m);      ///< Iron bars.
void add_plank_fence(Scene& scene, float length_m, float height_m);  ///< Boards.
void add_wire_fence(Scene& scene, float length_m, float height_m);   ///< Posts and mesh wire.

}  // namespace km
