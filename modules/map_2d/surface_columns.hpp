#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Cells of a horizontal grid, without values. The vertical axis is z.
struct CellGrid {
  double resolution_m = 0.05;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< Corner of cell (0, 0) [m].
  int width = 0, height = 0;                         ///< [cells]

  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  [[nodiscard]] bool contains(int x, int y) const {
    return x >= 0 && y >= 0 && x < width && y < height;
  }
  [[nodiscard]] std::uint32_t index(int x, int y) const {
    return static_cast<std::uint32_t>(x) +
           static_cast<std::uint32_t>(width) * static_cast<std::uint32_t>(y);
  }
  [[nodiscard]] double area_m2() const { return resolution_m * resolution_m; }
};

/// Number of cells along x and y that the mesh needs, as numbers that do not overflow; (0, 0) for a
/// mesh without finite vertices.
[[nodiscard]] Eigen::Vector2d cells_needed(const LabelledMesh& mesh, double resolution_m);

/// The smallest grid over the mesh with corners at multiples of the resolution, so that the grids
/// of two meshes in one frame have the same cells. Precondition: cells_needed() fits into int.
[[nodiscard]] CellGrid grid_over(const LabelledMesh& mesh, double resolution_m);

/// Kind of surface.
enum class SurfaceKind : std::uint8_t {
  kOther,  ///< Walls, undersides, slopes above 35 degrees.
  kTop,    ///< Seen from above, slope at most 35 degrees, with a label that is not of floor.
  kLevel,  ///< The same without a label.
  kFloor,  ///< Labelled as floor, of any slope.
};

/// Surface of one kind in one cell and one step of height.
struct SurfaceLayer {
  std::int16_t step = 0;  ///< Height: step * SurfaceColumns::kStep_m.
  SurfaceKind kind = SurfaceKind::kOther;
  float area_m2 = 0.0F;
};

/// The surface of a mesh, summed over the cells of a grid and steps of height. Areas are summed as
/// integers, so that the result does not depend on the order of the faces.
class SurfaceColumns {
 public:
  static constexpr double kStep_m = 0.025;

  /// `is_floor` is true for the labels of floor. Faces are sampled at distances below the
  /// resolution. Vertices that are not finite or more than 800 m above or below the origin are left
  /// out.
  SurfaceColumns(const LabelledMesh& mesh, const CellGrid& grid,
                 const std::array<bool, 256>& is_floor);

  [[nodiscard]] const CellGrid& grid() const { return grid_; }

  /// The layers of a cell, ascending by height.
  [[nodiscard]] std::span<const SurfaceLayer> operator[](std::uint32_t cell) const {
    return std::span(layers_).subspan(first_[cell], first_[cell + 1] - first_[cell]);
  }

  /// Area of all surface of a kind [m^2].
  [[nodiscard]] double area_m2(SurfaceKind kind) const {
    return areas_[static_cast<std::size_t>(kind)];
  }

  static double height_m(const SurfaceLayer& layer) { return kStep_m * layer.step; }

 private:
  CellGrid grid_;
  std::vector<SurfaceLayer> layers_;
  std::vector<std::uint32_t> first_;
  std::array<double, 4> areas_ = {};
};

}  // namespace km
