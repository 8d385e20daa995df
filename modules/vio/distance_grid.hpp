#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <opencv2/core/types.hpp>
#include <vector>

namespace km {

/// Points of an image that keep a distance. They lie in square buckets of that side, so that all
/// within the distance of a place are in the nine buckets around it.
class DistanceGrid {
 public:
  /// `size` of the image, `distance` in pixels.
  DistanceGrid(const cv::Size& size, float distance)
      : distance_(distance),
        columns_(static_cast<int>(static_cast<float>(size.width) / distance) + 1),
        rows_(static_cast<int>(static_cast<float>(size.height) / distance) + 1),
        buckets_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

  void add(const Eigen::Vector2f& px) { buckets_[index(column(px), row(px))].push_back(px); }

  /// Whether no point is nearer than the distance.
  [[nodiscard]] bool is_free(const Eigen::Vector2f& px) const {
    for (int r = std::max(row(px) - 1, 0); r <= std::min(row(px) + 1, rows_ - 1); ++r) {
      for (int c = std::max(column(px) - 1, 0); c <= std::min(column(px) + 1, columns_ - 1); ++c) {
        for (const Eigen::Vector2f& other : buckets_[index(c, r)]) {
          if ((other - px).squaredNorm() < distance_ * distance_) return false;
        }
      }
    }
    return true;
  }

 private:
  [[nodiscard]] int column(const Eigen::Vector2f& px) const {
    return std::clamp(static_cast<int>(px.x() / distance_), 0, columns_ - 1);
  }
  [[nodiscard]] int row(const Eigen::Vector2f& px) const {
    return std::clamp(static_cast<int>(px.y() / distance_), 0, rows_ - 1);
  }
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  float distance_;
  int columns_;
  int rows_;
  std::vector<std::vector<Eigen::Vector2f>> buckets_;
};

}  // namespace km
