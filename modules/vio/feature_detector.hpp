#pragma once

#include <Eigen/Core>
#include <span>
#include <tuple>
#include <vector>

#include "modules/vio/distance_grid.hpp"
#include "modules/vio/image_pyramid.hpp"
#include "modules/vio/tracker_config.hpp"

namespace km {

/// Finds new corners where an image has no features yet. Not thread-safe: it keeps its buffers.
///
/// Candidates are FAST corners (Rosten and Drummond, ECCV 2006), at a high threshold first and at
/// config.fast_threshold where that finds none. They are ranked by the smaller eigenvalue of the
/// gradient matrix (Shi and Tomasi, CVPR 1994), which the pyramid's derivatives give at once.
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
    int rank = 0;  // Features and better corners in its cell.

    // Total orders, so that the result does not depend on how equal scores are sorted.
    static bool better(const Candidate& a, const Candidate& b) {
      return std::tuple(-a.score, a.px.y, a.px.x) < std::tuple(-b.score, b.px.y, b.px.x);
    }
    static bool earlier(const Candidate& a, const Candidate& b) {
      return a.rank != b.rank ? a.rank < b.rank : better(a, b);
    }
  };
  static constexpr int kMaxInCell = 3;  // Cells with so many features are left alone.

  void add_corners_of(const cv::Rect& cell, int features_there, const ImagePyramid& image);

  void take_best(int count, DistanceGrid& grid, std::vector<Eigen::Vector2f>& taken) const;

  TrackerConfig config_;
  std::vector<Candidate> candidates_;
};

}  // namespace km
