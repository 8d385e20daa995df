#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "apps/lab/simulation/world/scene.hpp"

namespace km {

// Objects of a world; the conventions are those of Scene.

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
/// A board with raised characters on the wall y = 0, its lower left corner at (x, z).
void add_sign_board(Scene& scene, float x, float z, float width_m, float height_m,
                    SurfaceClass label, SeededRandom& random);

/// Fences from x = 0 to `length_m` along y = 0.
void add_railing(Scene& scene, float length_m, float height_m);      ///< Iron bars.
void add_plank_fence(Scene& scene, float length_m, float height_m);  ///< Boards.
void add_wire_fence(Scene& scene, float length_m, float height_m);   ///< Posts and mesh wire.

/// A broad-leaved tree: trunk, two orders of branches, leaf clusters at their ends. Nothing of the
/// crown hangs below `clear_m`.
struct TreeShape {
  float height_m = 8.0F;
  float crown_radius_m = 2.4F;
  float clear_m = 2.8F;
  int leaves = 1400;
  float leaf_m = 0.36F;
};
void add_tree(Scene& scene, const TreeShape& shape, SeededRandom& random);
/// A fir: tiers of drooping branches down to the ground.
void add_conifer(Scene& scene, float height_m, SeededRandom& random);
void add_bush(Scene& scene, float radius_m, SeededRandom& random);
/// A clipped hedge from x = 0 to `length_m`, its front at y = 0.
void add_hedge(Scene& scene, float length_m, float depth_m, float height_m, SeededRandom& random);
/// A tuft of grass blades.
void add_tuft(Scene& scene, float height_m, SeededRandom& random);

/// A standing or striding person, 1.6 to 1.9 m tall.
void add_person(Scene& scene, SeededRandom& random);

/// A parked road vehicle: body, windows, wheels, lights, mirrors, plates.
enum class VehicleKind : std::uint8_t { kSedan, kHatchback, kEstate, kVan };
void add_vehicle(Scene& scene, VehicleKind kind, SeededRandom& random);
/// A high-wheeled lorry with cab and load bed under canvas, 6.6 m long.
void add_army_truck(Scene& scene, SeededRandom& random);
/// An open-backed off-road car, 4 m long.
void add_army_jeep(Scene& scene, SeededRandom& random);

/// Tents stand with their door at -y. `cloth` is the colour of the canvas; walls reach half a metre
/// into the ground, which may be uneven.
void add_ridge_tent(Scene& scene, const Eigen::Vector3f& cloth, SeededRandom& random);  ///< 3 x 4 m
void add_house_tent(Scene& scene, float length_m, const Eigen::Vector3f& cloth,
                    SeededRandom& random);  ///< 5 m wide, upright walls.
void add_tunnel_shelter(Scene& scene, float length_m, const Eigen::Vector3f& cloth);  ///< 6 m wide
void add_dome_tent(Scene& scene, float radius_m, const Eigen::Vector3f& cloth);
/// A sail on four poles, 5 x 4 m, to sit below.
void add_awning_roof(Scene& scene, const Eigen::Vector3f& cloth);

/// A guard's post of timber, 6 m tall.
void add_watch_tower(Scene& scene);
/// A mast with two floodlights that face -y.
void add_floodlight(Scene& scene);
void add_flag_pole(Scene& scene, SeededRandom& random);
/// A board with writing on two posts.
void add_notice_board(Scene& scene, SeededRandom& random);
/// A freight container, 6.06 m along x, 2.44 m wide, 2.59 m tall; doors at +x.
void add_container(Scene& scene, SeededRandom& random);
/// Stacks of boxes with battens.
void add_crates(Scene& scene, SeededRandom& random);
void add_barrels(Scene& scene, SeededRandom& random);
/// A wall of sandbags from x = 0 to `length_m`.
void add_sandbags(Scene& scene, float length_m, SeededRandom& random);
void add_rock(Scene& scene, float size_m, SeededRandom& random);
/// Concrete barrier of 3 m along x.
void add_barrier(Scene& scene);
void add_generator(Scene& scene, SeededRandom& random);
void add_toilet_cabin(Scene& scene, SeededRandom& random);
void add_water_tank(Scene& scene, SeededRandom& random);
void add_log_pile(Scene& scene, SeededRandom& random);

// Furniture and clutter of a room. "Against the wall" means that the back touches the plane y = 0
// and nothing lies beyond it.

/// Foam mattress that stands against the wall, leaning by `lean_m` at its foot.
void add_leaning_mattress(Scene& scene, const Eigen::Vector3f& size_m, float lean_m,
                          SeededRandom& random);
/// `count` mattresses of 2 x 1.3 m on each other, centred.
void add_mattress_stack(Scene& scene, int count, SeededRandom& random);
/// Flat board, its lower left corner at the origin, leaning back by `lean_rad`.
void add_board(Scene& scene, float width_m, float height_m, float lean_rad, MaterialId front,
               MaterialId body);
/// Table against the wall, with `clutter` things on it.
void add_table(Scene& scene, float width_m, float depth_m, int clutter, SeededRandom& random);
void add_chair(Scene& scene, SeededRandom& random);
/// Shelves against the wall, full of books, boxes and bottles.
void add_shelf(Scene& scene, float width_m, float height_m, SeededRandom& random);
/// Screen, keyboard and computer on a desk against the wall.
void add_desk(Scene& scene, SeededRandom& random);
void add_radiator(Scene& scene, float width_m);
/// Stepladder, folded, leaning against the wall.
void add_ladder(Scene& scene, float height_m);
/// Stand with clamps, as cameras and lamps are mounted on.
void add_stand(Scene& scene, float height_m, SeededRandom& random);
/// Cardboard or plastic box with a label, centred.
void add_carton(Scene& scene, const Eigen::Vector3f& size_m, SeededRandom& random);
void add_bucket(Scene& scene, SeededRandom& random);

}  // namespace km
