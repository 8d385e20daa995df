#include "apps/lab/simulation/world/terrain.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

/// Value in [-1, 1] of a lattice point.
float lattice(std::int64_t i, std::int64_t j, std::uint64_t seed) {
  const std::uint64_t h = scrambled(seed + 0x9E3779B97F4A7C15U * static_cast<std::uint64_t>(i) +
                                    0xC2B2AE3D27D4EB4FU * static_cast<std::uint64_t>(j));
  return static_cast<float>(h >> 40U) * 0x1.0p-23F - 1.0F;
}

float smooth(float t) {
  return t * t * t * (t * (6.0F * t - 15.0F) + 10.0F);
}

}  // namespace

float ground_noise(float x, float y, float feature_m, std::uint64_t seed) {
  const float u = x / feature_m;
  const float v = y / feature_m;
  const float u0 = std::floor(u);
  const float v0 = std::floor(v);
  const auto i = static_cast<std::int64_t>(u0);
  const auto j = static_cast<std::int64_t>(v0);
  const float s = smooth(u - u0);
  const float t = smooth(v - v0);
  const float low = std::lerp(lattice(i, j, seed), lattice(i + 1, j, seed), s);
  const float high = std::lerp(lattice(i, j + 1, seed), lattice(i + 1, j + 1, seed), s);
  return std::lerp(low, high, t);
}

Heightfield::Heightfield(const Eigen::Vector2f& origin, float cell_m, int columns, int rows,
                         const std::function<float(float, float)>& height)
    : origin_(origin), cell_m_(cell_m), columns_(columns), rows_(rows) {
  if (columns < 1 || rows < 1 || !(cell_m > 0.0F)) {
    throw std::invalid_argument("Heightfield: " + std::to_string(columns) + " x " +
                                std::to_string(rows) + " cells of " + std::to_string(cell_m) +
                                " m");
  }
  heights_.reserve((static_cast<std::size_t>(columns) + 1) * (static_cast<std::size_t>(rows) + 1));
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      heights_.push_back(height(origin.x() + cell_m * static_cast<float>(column),
                                origin.y() + cell_m * static_cast<float>(row)));
    }
  }
}

Eigen::Vector3f Heightfield::point(int row, int column) const {
  return {origin_.x() + cell_m_ * static_cast<float>(column),
          origin_.y() + cell_m_ * static_cast<float>(row), heights_[index(row, column)]};
}

Eigen::Vector3f Heightfield::normal(int row, int column) const {
  const Eigen::Vector3f east = point(row, std::min(column + 1, columns_));
  const Eigen::Vector3f west = point(row, std::max(column - 1, 0));
  const Eigen::Vector3f north = point(std::min(row + 1, rows_), column);
  const Eigen::Vector3f south = point(std::max(row - 1, 0), column);
  return (east - west).cross(north - south);
}

bool Heightfield::contains(double x, double y) const {
  const double u = (x - origin_.x()) / cell_m_;
  const double v = (y - origin_.y()) / cell_m_;
  return u >= 0.0 && v >= 0.0 && u <= columns_ && v <= rows_;
}

double Heightfield::at(double x, double y) const {
  const double u = std::clamp((x - origin_.x()) / cell_m_, 0.0, static_cast<double>(columns_));
  const double v = std::clamp((y - origin_.y()) / cell_m_, 0.0, static_cast<double>(rows_));
  const int column = std::min(static_cast<int>(u), columns_ - 1);
  const int row = std::min(static_cast<int>(v), rows_ - 1);
  const double s = u - column;
  const double t = v - row;
  const double a = heights_[index(row, column)];
  const double c = heights_[index(row + 1, column + 1)];
  if (s >= t) {
    const double b = heights_[index(row, column + 1)];
    return a + s * (b - a) + t * (c - b);
  }
  const double d = heights_[index(row + 1, column)];
  return a + t * (d - a) + s * (c - d);
}

}  // namespace km
