#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "modules/evaluation/images/image_figure.hpp"

namespace km {

/// Standard deviation over the median absolute deviation, of a normal distribution.
inline constexpr double kMadToSigma = 1.0 / 0.6745;

/// Size of the gradient of an 8-bit image, per pixel [levels/px]: Sobel 3x3 over 8, as CV_32F.
[[nodiscard]] cv::Mat gradient_magnitude(const cv::Mat& image);

/// Median of magnitudes that were rounded to integers, of which histogram[k] are k: those are taken
/// to lie evenly within k - 1/2 and k + 1/2 (0 and 1/2 for k = 0), so that the result is no integer
/// and small changes of the sample change it little. NaN for an empty sample.
[[nodiscard]] double grouped_median(const std::vector<std::uint64_t>& histogram);

/// Standard deviation of the noise of one image [levels] from its second differences where it is
/// flat (gradient below `max_gradient`), so that structure does not count: the median of
/// |Laplacian of Immerkaer, "Fast Noise Variance Estimation", CVIU 1996, Eq. (1)| / 6 over 0.6745.
/// `gradient` as above. Noise that is correlated between pixels counts less than it is. NaN without
/// a flat pixel.
[[nodiscard]] double noise_within(const cv::Mat& image, const cv::Mat& gradient,
                                  double max_gradient);

/// Grey levels, gradients, exposure, blur and noise of single images.
class LevelStatistics {
 public:
  /// Images of one instant; `right` may be empty. `flow_px`: median flow since the image before;
  /// NaN if unknown.
  void add(const cv::Mat& left, const cv::Mat& right, double flow_px);

  void append_to(std::vector<ImageFigure>& figures) const;

 private:
  void add_gradients(const cv::Mat& gradient, double flow_px);
  void add_blur(const cv::Mat& left, double flow_px);

  std::vector<double> means_, deviations_, saturated_, dark_, steps_, right_over_left_;
  std::vector<double> blur_, log_blur_, flow_;  // the last two: where the flow is known
  std::vector<double> noise_, gradient_means_;
  FlowBinMeans gradient_by_flow_, blur_by_flow_;
  std::array<std::uint64_t, 4096> gradients_{};  // histogram in steps of 1/16 level
};

}  // namespace km
