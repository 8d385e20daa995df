#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/world/scene.hpp"

namespace km {

/// Cross-section of every street, from its centre line outwards [m].
inline constexpr float kLaneOffset_m = 1.6F;
inline constexpr float kLaneEdge_m = 3.1F;      ///< Begin of the parking lane.
inline constexpr float kHalfRoad_m = 5.2F;      ///< The kerb.
inline constexpr float kSidewalk_m = 2.8F;      ///< Width with the kerb stone.
inline constexpr float kKerb_m = 0.12F;         ///< Height of the sidewalk above the road.
inline constexpr float kCornerRadius_m = 4.0F;  ///< Radius of the kerb at corners.

/// One side of a street between two crossings. Frame: x along the building line, left to right seen
/// from the street, which lies at negative y; z = 0 is the sidewalk.
struct StreetSide {
  Eigen::Isometry3f T_world_side = Eigen::Isometry3f::Identity();
  float length_m = 0.0F;
};

/// A grid of streets around 3 x 3 blocks. Streets 0 and 3 of either direction have houses on their
/// outer side that close the view.
struct CityPlan {
  static constexpr int kBlocks = 3;

  std::array<float, 4> x{};       ///< Centre lines of the streets along y [m].
  std::array<float, 4> y{};       ///< Centre lines of the streets along x [m].
  std::array<float, 4> phases{};  ///< Phases of the ground's waves [rad].

  /// Kerb line of a block; column and row 0 .. 2.
  [[nodiscard]] Eigen::AlignedBox2f block(int column, int row) const;
  /// South, east, north, west side of the building line of a rectangle bounded by kerbs.
  [[nodiscard]] static std::array<StreetSide, 4> sides(const Eigen::AlignedBox2f& kerb);
  /// South, east, north, west side of the houses outside the grid, which face inwards.
  [[nodiscard]] std::array<StreetSide, 4> outer_sides() const;
  /// The outer sides, cut at the crossings like the sides of blocks.
  [[nodiscard]] std::vector<StreetSide> outer_pieces() const;
  /// Gentle waves under the whole city [m], slopes below 3 %.
  [[nodiscard]] double ground(double px, double py) const;
};

[[nodiscard]] CityPlan make_city_plan(std::uint64_t seed);

/// Closed right-hand ways over the grid. Each drives one street twice in the same direction.
[[nodiscard]] std::vector<Route> city_routes(const CityPlan& plan);

/// Everything flat: asphalt with patches, lane lines, crosswalks, arrows and manholes, kerbs,
/// sidewalks, the ground inside the blocks. Level: CityPlan::ground() is added later.
void add_streets(Scene& scene, const CityPlan& plan, SeededRandom& random);

}  // namespace km
