#include "modules/evaluation/images/level_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>

namespace km {
namespace {

constexpr double kGradientBin = 1.0 / 16.0;
constexpr double kFlatGradient = 2.0;
constexpr double kStrongGradient = 10.0;
constexpr int kSaturated = 254;  // JPEG leaves 254 of a saturated 255
constexpr int kDark = 16;

// Level below which a share `p` of the histogram's pixels is, as the centre of its bin.
double histogram_quantile(const std::array<std::uint64_t, 4096>& histogram, double p) {
  const auto total = std::accumulate(histogram.begin(), histogram.end(), std::uint64_t{0});
  if (total == 0) return std::numeric_limits<double>::quiet_NaN();
  std::uint64_t below = 0;
  std::size_t bin = 0;
  while (bin + 1 < histogram.size() &&
         static_cast<double>(below + histogram[bin]) < p * static_cast<double>(total))
    below += histogram[bin++];
  return kGradientBin * (static_cast<double>(bin) + 0.5);
}

double share_above(const std::array<std::uint64_t, 4096>& histogram, double level) {
  const auto first = static_cast<std::ptrdiff_t>(level / kGradientBin);
  const auto above = std::accumulate(histogram.begin() + first, histogram.end(), std::uint64_t{0});
  const auto total = std::accumulate(histogram.begin(), histogram.end(), std::uint64_t{0});
  return static_cast<double>(above) / static_cast<double>(total);
}

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() < 3) return std::numeric_limits<double>::quiet_NaN();
  const double mean_x = mean_of(x);
  const double mean_y = mean_of(y);
  double xx = 0.0, yy = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    yy += (y[i] - mean_y) * (y[i] - mean_y);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  return xy / std::sqrt(xx * yy);
}

}  // namespace

double grouped_median(const std::vector<std::uint64_t>& histogram) {
  const auto total = std::accumulate(histogram.begin(), histogram.end(), std::uint64_t{0});
  if (total == 0) return std::numeric_limits<double>::quiet_NaN();
  const double half = 0.5 * static_cast<double>(total);
  double below = 0.0;
  for (std::size_t k = 0;; ++k) {
    const auto count = static_cast<double>(histogram[k]);
    if (below + count < half) {
      below += count;
      continue;
    }
    const double share = (half - below) / count;
    return k == 0 ? 0.5 * share : static_cast<double>(k) - 0.5 + share;
  }
}

cv::Mat gradient_magnitude(const cv::Mat& image) {
  cv::Mat dx, dy, magnitude;
  cv::Sobel(image, dx, CV_32F, 1, 0, 3, 1.0 / 8.0);
  cv::Sobel(image, dy, CV_32F, 0, 1, 3, 1.0 / 8.0);
  cv::magnitude(dx, dy, magnitude);
  return magnitude;
}

double noise_within(const cv::Mat& image, const cv::Mat& gradient, double max_gradient) {
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1);
  cv::Mat differences;
  cv::filter2D(image, differences, CV_16S, kernel);
  std::vector<std::uint64_t> histogram(8 * 255 + 1, 0);
  std::uint64_t flat = 0;
  for (int y = 1; y + 1 < image.rows; ++y) {
    const auto* const row = differences.ptr<std::int16_t>(y);
    const auto* const slope = gradient.ptr<float>(y);
    for (int x = 1; x + 1 < image.cols; ++x) {
      if (slope[x] >= max_gradient) continue;
      ++histogram[static_cast<std::size_t>(std::abs(int{row[x]}))];
      ++flat;
    }
  }
  if (flat == 0) return std::numeric_limits<double>::quiet_NaN();
  return kMadToSigma / 6.0 * grouped_median(histogram);
}

void LevelStatistics::add(const cv::Mat& left, const cv::Mat& right, double flow_px) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(left, mean, deviation);
  if (!means_.empty()) steps_.push_back(std::abs(mean[0] - means_.back()));
  means_.push_back(mean[0]);
  deviations_.push_back(deviation[0]);
  const auto pixels = static_cast<double>(left.total());
  saturated_.push_back(cv::countNonZero(left >= kSaturated) / pixels);
  dark_.push_back(cv::countNonZero(left < kDark) / pixels);
  if (!right.empty()) right_over_left_.push_back(cv::mean(right)[0] / mean[0]);
  const cv::Mat gradient = gradient_magnitude(left);
  add_gradients(gradient, flow_px);
  add_blur(left, flow_px);
  noise_.push_back(noise_within(left, gradient, kFlatGradient));
}

void LevelStatistics::add_gradients(const cv::Mat& gradient, double flow_px) {
  double sum = 0.0;
  for (int y = 0; y < gradient.rows; ++y) {
    const auto* const row = gradient.ptr<float>(y);
    for (int x = 0; x < gradient.cols; ++x) {
      sum += row[x];
      ++gradients_[std::min(gradients_.size() - 1,
                            static_cast<std::size_t>(row[x] / static_cast<float>(kGradientBin)))];
    }
  }
  gradient_means_.push_back(sum / static_cast<double>(gradient.total()));
  gradient_by_flow_.add(flow_px, gradient_means_.back());
}

void LevelStatistics::add_blur(const cv::Mat& left, double flow_px) {
  cv::Mat laplacian;
  cv::Laplacian(left, laplacian, CV_32F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  const double variance = deviation[0] * deviation[0];
  blur_.push_back(variance);
  blur_by_flow_.add(flow_px, variance);
  if (std::isnan(flow_px) || variance <= 0.0) return;
  log_blur_.push_back(std::log(variance));
  flow_.push_back(flow_px);
}

void LevelStatistics::append_to(std::vector<ImageFigure>& figures) const {
  FigureList grey(figures, "grey levels");
  grey.add("image mean", mean_of(means_), 1);
  grey.add("image standard deviation", mean_of(deviations_), 1);
  grey.add("saturated share", mean_of(saturated_), 4);
  grey.add_quantiles("saturated share", saturated_, {100}, 4);
  grey.add("share below 16", mean_of(dark_), 4);
  FigureList gradients(figures, "gradient magnitude [levels/px]");
  gradients.add("mean", mean_of(gradient_means_), 2);
  gradients.add("median", histogram_quantile(gradients_, 0.5), 2);
  gradients.add("p90", histogram_quantile(gradients_, 0.9), 2);
  gradients.add("share above 10", share_above(gradients_, kStrongGradient));
  for (std::size_t bin = 0; bin < kFlowBinCount; ++bin)
    gradients.add("mean, " + flow_bin_name(bin), gradient_by_flow_.mean(bin), 2);
  FigureList exposure(figures, "exposure [levels]");
  exposure.add_quantiles("frame mean", means_, {0, 100}, 1);
  exposure.add_quantiles("step between frames", steps_, {50, 95, 100}, 2);
  exposure.add("right over left, mean", mean_of(right_over_left_));
  exposure.add_quantiles("right over left", right_over_left_, {5, 95});
  FigureList blur(figures, "motion blur: variance of the Laplacian");
  blur.add_quantiles("all frames,", blur_, {5, 50, 95}, 0);
  blur.add("correlation of its log with the median flow", correlation(log_blur_, flow_), 2);
  for (std::size_t bin = 0; bin < kFlowBinCount; ++bin)
    blur.add("mean, " + flow_bin_name(bin), blur_by_flow_.mean(bin), 0);
  FigureList noise(figures, "noise [levels]");
  noise.add("within one image, flat pixels", mean_of(noise_));
}

}  // namespace km
