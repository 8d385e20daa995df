#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "apps/lab/simulation/world/scene.hpp"

namespace km {

// Objects of a world; the conventions are those of Scene.

/// Objects of a few boxes, tubes and balls, from a table.
enum class Prop : std::uint8_t {
  kStreetLamp,
  kRoundSign,
  kNameSign,
  kTrafficLight,
  kBench,
  kBin,
  kHydrant,
  kAdvertisingColumn,
  kPlanter,
  kMonument,
  kNoticeBoard,
  kStandingPerson,
  kStridingPerson,
  kRailing,     ///< 2.4 m of iron bars along x.
  kPlankFence,  ///< 2.4 m of boards.
  kWireFence,   ///< 5 m of posts and mesh wire.
  kCrates,
  kBarrels,
  kGenerator,
  kWaterTank,
  kLogPile,
  kSandbags,
  kBarrier,
  kWatchTower,
  kFloodlight,
  kContainer,  ///< 6 m along x; doors at +x.
  kTruck,      ///< A lorry with its load under canvas.
  kJeep,
  kHatchback,
  kVan,
};

/// Colours and the place of the texture are drawn.
void add_prop(Scene& scene, Prop prop, SeededRandom& random);

/// A parked car: hatchback or van.
void add_car(Scene& scene, SeededRandom& random);
/// A standing or striding person.
void add_person(Scene& scene, SeededRandom& random);

/// A broad-leaved tree: trunk, boughs, leaf clusters at their ends. Nothing of the crown hangs
/// below 2.8 m.
void add_tree(Scene& scene, float height_m, SeededRandom& random);
/// A fir: tiers of drooping branches down to the ground.
void add_conifer(Scene& scene, float height_m, SeededRandom& random);
void add_bush(Scene& scene, float radius_m, SeededRandom& random);
/// A clipped hedge from x = 0 to `length_m`, its front at y = 0.
void add_hedge(Scene& scene, float length_m, float height_m, SeededRandom& random);
/// A tuft of grass blades.
void add_tuft(Scene& scene, float height_m, SeededRandom& random);
void add_rock(Scene& scene, float size_m, SeededRandom& random);

/// Tents stand with their door at -y. Walls reach half a metre into the ground, which may be
/// uneven.
enum class Tent : std::uint8_t { kRidge, kHouse, kTunnel, kDome };
/// `cloth` is the colour of the canvas.
void add_tent(Scene& scene, Tent tent, const Eigen::Vector3f& cloth);

/// Kind of one of the four walls of a house.
enum class WallKind : std::uint8_t { kRich, kPlain, kBlind, kNone };

/// A house on a rectangle: walls of x from 0 to width, of y from 0 to depth, front at y = 0. Its
/// style is drawn from those of one old town: brick, coloured plaster, stone, concrete panels.
struct House {
  std::uint64_t seed = 0;  ///< Equal seeds give equal styles.
  float width_m = 10.0F;
  float depth_m = 10.0F;
  int floors = 0;  ///< 0: drawn.
  WallKind front = WallKind::kRich, right = WallKind::kBlind, back = WallKind::kPlain,
           left = WallKind::kBlind;
};
void add_house(Scene& scene, const House& house);

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
