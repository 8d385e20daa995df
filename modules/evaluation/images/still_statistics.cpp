#include "modules/evaluation/images/still_statistics.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "modules/evaluation/images/level_statistics.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

constexpr double kLag_s = 1.0;
constexpr double kStillLagTolerance_s = 0.1;
constexpr double kCompareEvery_s = 0.5;
constexpr double kMaxFlow_px = 0.1;
constexpr double kReturns_px = 1.0;
constexpr double kFlatStillGradient = 3.0;   // [levels/px]
constexpr double kFlatGradientWithin = 2.0;  // limit for noise_within() [levels/px]
constexpr std::size_t kMinCorners = 20;

double robust_sigma(std::vector<double> values) {
  const double median = quantile(values, 0.5);
  for (double& value : values) value = std::abs(value - median);
  return kMadToSigma * quantile(std::move(values), 0.5);
}

}  // namespace

void StillStatistics::add(Stamp stamp, const KltImage& image,
                          const std::vector<cv::Point2f>& corners) {
  // Stamps that do not ascend show that another part of the recording begins.
  if (!kept_.empty() && stamp <= kept_.back().stamp) {
    kept_.clear();
    last_compared_ = 0;
  }
  const auto age_s = [&](const Kept& kept) { return seconds_between(kept.stamp, stamp); };
  while (!kept_.empty() && age_s(kept_.front()) > kLag_s + kStillLagTolerance_s) kept_.pop_front();
  if (!kept_.empty() && age_s(kept_.front()) >= kLag_s - kStillLagTolerance_s &&
      seconds_between(last_compared_, stamp) >= kCompareEvery_s) {
    last_compared_ = stamp;
    compare(kept_.front(), image);
  }
  kept_.push_back({stamp, image, corners});
}

void StillStatistics::compare(const Kept& before, const KltImage& image) {
  std::vector<double> x, y, lengths;
  const auto tracks = forward_backward(before.image, image, before.corners);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (tracks[i].error_px >= kReturns_px) continue;
    const cv::Point2f moved = tracks[i].to - before.corners[i];
    x.push_back(moved.x);
    y.push_back(moved.y);
    lengths.push_back(std::hypot(moved.x, moved.y));
  }
  if (lengths.size() < kMinCorners || quantile(lengths, 0.5) > kMaxFlow_px) return;
  ++pairs_;
  jitter_px_.push_back(robust_sigma(std::move(x)));
  jitter_px_.push_back(robust_sigma(std::move(y)));
  add_noise(before.image.image, image.image);
}

void StillStatistics::add_noise(const cv::Mat& before, const cv::Mat& image) {
  const cv::Mat gradient = gradient_magnitude(before);
  std::vector<std::uint64_t> histogram(256, 0);  // bins: magnitudes of the difference
  double squares = 0.0;
  double count = 0.0;
  for (int y = 1; y + 1 < image.rows; ++y) {
    const auto* const slope = gradient.ptr<float>(y);
    const auto* const a = before.ptr<std::uint8_t>(y);
    const auto* const b = image.ptr<std::uint8_t>(y);
    for (int x = 1; x + 1 < image.cols; ++x) {
      if (slope[x] >= kFlatStillGradient) continue;
      const int difference = std::abs(int{b[x]} - int{a[x]});
      ++histogram[static_cast<std::size_t>(difference)];
      const double square = difference * difference;
      squares += square;
      ++count;
      for (LevelRange& range : ranges_) {
        if (a[x] < range.from || a[x] >= range.to) continue;
        range.squares += square;
        ++range.count;
      }
    }
  }
  if (count == 0.0) return;
  deviations_.push_back(std::sqrt(squares / count) / std::numbers::sqrt2);
  robust_.push_back(kMadToSigma * grouped_median(histogram) / std::numbers::sqrt2);
  within_.push_back(noise_within(before, gradient, kFlatGradientWithin));
}

void StillStatistics::append_to(std::vector<ImageFigure>& figures) const {
  FigureList still(figures, "standing still, images 1 s apart");
  still.add("pairs of images", pairs_, 0);
  still.add("temporal noise, flat pixels [levels]", mean_of(deviations_), 2);
  still.add("the same, robust", mean_of(robust_), 2);
  for (const LevelRange& range : ranges_)
    still.add("temporal noise, grey " + std::to_string(range.from) + '-' + std::to_string(range.to),
              std::sqrt(range.squares / range.count) / std::numbers::sqrt2, 2);
  still.add("noise within one image", mean_of(within_), 2);
  still.add("KLT jitter per axis [px]", mean_of(jitter_px_));
}

}  // namespace km
