#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <opencv2/core/types.hpp>
#include <span>
#include <tuple>
#include <vector>

#include "modules/vio/image_pyramid.hpp"
#include "modules/vio/tracker_config.hpp"

namespace km {

/// Points of an image with a minimum distance from each other. Square buckets whose side is this
/// distance store the points, so that all points within the distance of a position are in the nine
/// buckets around it.
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

/// Finds new corners where an image has no features yet. Not thread-safe, because it reuses
/// buffers.
///
/// Candidates are FAST corners (Rosten and Drummond, ECCV 2006). They are searched in each cell of
/// the image with a high threshold, and again with config.fast_threshold in cells without a corner.
/// Candidates are ranked by the smaller eigenvalue of the gradient matrix (Shi and Tomasi, CVPR
/// 1994), computed from the derivatives of the pyramid.
class FeatureDetector {
 public:
  explicit FeatureDetector(const TrackerConfig& config) : config_(config) {}

  /// Up to `count` corners [px], config.min_distance_px from each other and from `occupied` [px].
  /// The image is divided into square cells, and the best corner of each cell comes before the
  /// second best of any. `image` needs derivatives.
  [[nodiscard]] std::vector<Eigen::Vector2f> detect(const ImagePyramid& image,
                                                    std::span<const Eigen::Vector2f> occupied,
                                                    int count);

 private:
  struct Candidate {
    cv::Point2i px;
    float score = 0.0F;
    int rank = 0;  // Number of features and better corners in its cell.

    // Total orders, so that the result does not depend on how equal scores are sorted.
    static bool better(const Candidate& a, const Candidate& b) {
      return std::tuple(-a.score, a.px.y, a.px.x) < std::tuple(-b.score, b.px.y, b.px.x);
    }
    static bool earlier(const Candidate& a, const Candidate& b) {
      return a.rank != b.rank ? a.rank < b.rank : better(a, b);
    }
  };
  static constexpr int kFullCell = 3;  // Cells with as many features or more are not searched.

  void add_corners_of(const cv::Rect& cell, int features_there, const ImagePyramid& image);

  void take_best(int count, DistanceGrid& grid, std::vector<Eigen::Vector2f>& taken) const;

  TrackerConfig config_;
  std::vector<Candidate> candidates_;
};

}  // namespace km
