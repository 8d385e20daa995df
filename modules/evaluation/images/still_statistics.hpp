#pragma once

#include <deque>
#include <utility>
#include <vector>

#include "modules/core/stamp.hpp"
#include "modules/evaluation/images/forward_backward.hpp"
#include "modules/evaluation/images/image_figure.hpp"

namespace km {

/// Noise between images of a camera at standstill: pairs of images about a second apart with a
/// median flow below 0.1 px. Temporal noise is the standard deviation of their difference over
/// sqrt(2), on flat pixels. The robust version uses 1.4826 times the median magnitude instead. KLT
/// jitter is the same measure of the corners' displacement per axis, after removal of its median.
class StillStatistics {
 public:
  /// Adds the next left image and corners_of() it.
  void add(Stamp stamp, const KltImage& image, const std::vector<cv::Point2f>& corners);

  [[nodiscard]] int pairs() const { return pairs_; }
  void append_to(std::vector<ImageFigure>& figures) const;

 private:
  struct Kept {
    Stamp stamp = 0;
    KltImage image;
    std::vector<cv::Point2f> corners;
  };
  // Sums over flat pixels of a range of grey levels.
  struct LevelRange {
    int from = 0;
    int to = 0;  // first level beyond
    double squares = 0.0;
    double count = 0.0;
  };

  void compare(const Kept& before, const KltImage& image);
  void add_noise(const cv::Mat& before, const cv::Mat& image);

  std::deque<Kept> kept_;  // images of the last second
  Stamp last_compared_ = 0;
  int pairs_ = 0;
  std::vector<double> deviations_, robust_, within_, jitter_px_;
  std::vector<LevelRange> ranges_ = {{20, 50}, {50, 80}, {80, 110}, {110, 200}, {200, 230}};
};

}  // namespace km
