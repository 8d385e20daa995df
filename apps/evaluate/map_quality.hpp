#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <string>

#include "modules/core/io/json.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A point of the true surface that a camera saw, and the smallest depth from which it was seen.
struct SeenPoint {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();  ///< [m]
  float depth_m = 0.0F;
  LabelId label = 0;
};

/// Part of the seen points, and the shares of it that the map has within a distance.
struct MappedShare {
  std::size_t points = 0;
  double within_5cm = 0.0, within_20cm = 0.0;  ///< 0 to 1.
};

/// How much of the seen surface a map has, and how smooth its walls are.
struct MapQuality {
  static constexpr std::array<float, 3> kDepths_m = {10.0F, 20.0F, 40.0F};

  std::array<MappedShare, 3> by_depth;     ///< Up to each of kDepths_m, from the one before on.
  std::array<MappedShare, 256> by_class;   ///< By true label, of the points seen below 20 m.
  double within_5cm = 0.0;                 ///< Share of the map within this distance of the truth.
  double within_10cm = 0.0;                ///< Share within 10 cm.
  double median_mm = 0.0;                  ///< Median distance from the map to the truth.
  double wall_deg = 0.0, floor_deg = 0.0;  ///< Median angle between a face and the true plane.
  double wall_rms_mm = 0.0;                ///< Rms distance to the local plane (cells of 0.5 m).
  double rim_m_per_m2 = 0.0;               ///< Length of open edges.
};

/// Compares a map with the truth, both in one frame. Walls and floors are faces near true surface
/// of these classes. Numbers without samples are NaN. Time n log n in the surface.
[[nodiscard]] MapQuality map_quality(const LabelledMesh& truth, const LabelledMesh& map,
                                     std::span<const SeenPoint> seen, const LabelPalette& palette);

[[nodiscard]] std::string to_table(const MapQuality& quality, const LabelPalette& palette);
[[nodiscard]] Json to_json(const MapQuality& quality, const LabelPalette& palette);

}  // namespace km
