#pragma once

#include <limits>
#include <map>
#include <vector>

#include "modules/core/stamp.hpp"
#include "modules/evaluation/images/forward_backward.hpp"
#include "modules/evaluation/images/image_figure.hpp"

namespace km {

/// Survival of the corners of one camera under KLT tracking. A corner survives a step if it returns
/// within 1 px (for the strict figures 0.5 px) and stays inside the image. A corner that does not
/// return and ends less than 10 px from the rim has left the image; any other has failed.
///
/// New corners of every frame give the figures of one step. Sets of corners without replacement, a
/// new set every `stride` frames, give the survival over many steps. If a frame is missing, tracks
/// continue, but the step does not count in the figures of one step.
class TrackStatistics {
 public:
  /// A step of more than `max_step_s` ends all tracks.
  TrackStatistics(int stride, double max_step_s) : stride_(stride), max_step_s_(max_step_s) {}

  /// Adds the next image and corners_of() it. Returns the median flow since the image before
  /// [px/frame]; NaN if there is none.
  double add(Stamp stamp, const KltImage& image, const std::vector<cv::Point2f>& corners);

  void append_to(std::vector<ImageFigure>& figures) const;

 private:
  // Corners of one frame that are still tracked.
  struct TrackSet {
    std::size_t start_count = 0;
    std::size_t age = 0;  // steps
    double flow_sum_px = 0.0;
    std::vector<cv::Point2f> points;
    std::vector<bool> strict;  // within 0.5 px in every step
  };

  // Results for the corners of the last image.
  struct Step {
    double corners = 0.0, survived = 0.0, left = 0.0;
    double flow_px = 0.0;  // median of the surviving corners; NaN without one
  };

  [[nodiscard]] Step one_step(const KltImage& image) const;
  void record(const Step& step);
  void follow(const KltImage& image, double flow_px);
  void record(const TrackSet& set);

  int stride_;
  double max_step_s_;
  std::size_t frames_ = 0;
  Stamp last_stamp_ = 0;
  double period_s_ = std::numeric_limits<double>::infinity();  // shortest step so far
  KltImage last_;
  std::vector<cv::Point2f> last_corners_;
  std::vector<TrackSet> sets_;

  std::vector<double> corner_counts_, flow_, survived_, left_, failed_;
  FlowBinMeans survived_by_flow_, left_by_flow_, corners_by_flow_;
  std::map<std::size_t, std::vector<double>> survival_, strict_survival_;  // shares of surviving
                                                                           // tracks, by age
  FlowBinMeans ten_frames_by_flow_;
};

}  // namespace km
