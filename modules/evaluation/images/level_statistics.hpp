#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "modules/evaluation/images/image_figure.hpp"

namespace km {

/// Ratio of standard deviation to median absolute deviation of a normal distribution.
inline constexpr double kMadToSigma = 1.0 / 0.6745;

/// Magnitude of the gradient of an 8-bit image, per pixel [levels/px]: Sobel 3x3 over 8, as CV_32F.
[[nodiscard]] cv::Mat gradient_magnitude(const cv::Mat& image);

/// Median of magnitudes rounded to integers; histogram[k] is the number of values k. These are
/// assumed to be uniform between k - 1/2 and k + 1/2 (0 and 1/2 for k = 0). The result is therefore
/// not an integer, and small changes of the sample change it little. NaN for an empty sample.
[[nodiscard]] double grouped_median(const std::vector<std::uint64_t>& histogram);

/// Standard deviation of the noise of one image [levels] from its second differences at flat pixels
/// (gradient below `max_gradient`), so that structure does not count. It is the median of
/// |Laplacian of Immerkaer, "Fast Noise Variance Estimation", CVIU 1996, Eq. (1)| / 6 over 0.6745.
/// `gradient`: see gradient_magnitude(). Noise that is correlated between pixels is underestimated.
/// NaN without a flat pixel.
[[nodiscard]] double noise_within(const cv::Mat& image, const cv::Mat& gradient,
                                  double max_gradient);

/// Grey levels, gradients, exposure, blur and noise of single images.
class LevelStatistics {
 public:
  /// Adds the images of one instant; `right` may be empty. `flow_px`: median flow since the image
  /// before; NaN if unknown.
  void add(const cv::Mat& left, const cv::Mat& right, double flow_px);

  void append_to(std::vector<ImageFigure>& figures) const;

 private:
  void add_gradients(const cv::Mat& gradient, double flow_px);
  void add_blur(const cv::Mat& left, double flow_px);

  std::vector<double> means_, deviations_, saturated_, dark_, steps_, right_over_left_;
  std::vector<double> blur_, log_blur_, flow_;  // the last two: only with known flow
  std::vector<double> noise_, gradient_means_;
  FlowBinMeans gradient_by_flow_, blur_by_flow_;
  std::array<std::uint64_t, 4096> gradients_{};  // histogram in steps of 1/16 level
};

}  // namespace km
