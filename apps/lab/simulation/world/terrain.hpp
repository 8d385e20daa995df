#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

namespace km {

/// Smooth noise in [-1, 1] with features of about `feature_m`. It depends only on its arguments.
[[nodiscard]] float ground_noise(float x, float y, float feature_m, std::uint64_t seed);

/// Heights over a regular grid. Between grid points the surface consists of two triangles per cell,
/// cut from the lower left to the upper right corner, as in MeshBuilder::sheet().
class Heightfield {
 public:
  /// Samples `height` at the corners of columns x rows cells of `cell_m` from `origin` on. Throws
  /// std::invalid_argument for less than one cell or a cell without size.
  Heightfield(const Eigen::Vector2f& origin, float cell_m, int columns, int rows,
              const std::function<float(float, float)>& height);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] Eigen::Vector3f point(int row, int column) const;
  /// Normal at a grid point, of any length; from its neighbours, one-sided at the border.
  [[nodiscard]] Eigen::Vector3f normal(int row, int column) const;
  void set_height(int row, int column, float height_m) { heights_[index(row, column)] = height_m; }
  [[nodiscard]] bool contains(double x, double y) const;
  /// Height of the surface [m]; outside the grid that of the nearest border.
  [[nodiscard]] double at(double x, double y) const;

 private:
  [[nodiscard]] std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * (static_cast<std::size_t>(columns_) + 1) +
           static_cast<std::size_t>(column);
  }

  Eigen::Vector2f origin_;
  float cell_m_;
  int columns_;
  int rows_;
  std::vector<float> heights_;
};

}  // namespace km
