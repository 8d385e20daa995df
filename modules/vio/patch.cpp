#include "modules/vio/patch.hpp"

#include <array>
#include <cmath>
#include <cstdint>

namespace km {
namespace {

constexpr int kRadius = 5;
constexpr int kSide = 2 * kRadius + 1;
constexpr float kMinDeviation = 1.0F;  // Grey levels; below, the patch is noise.

using Patch = std::array<float, kSide * kSide>;

// Bilinear samples minus their mean; false if outside of the image or flat.
bool sample(const cv::Mat& image, const Eigen::Vector2f& at, Patch& patch, float& norm) {
  const float left = at.x() - kRadius;
  const float top = at.y() - kRadius;
  if (!(left >= 0.0F && top >= 0.0F && at.x() + kRadius + 1 < static_cast<float>(image.cols) &&
        at.y() + kRadius + 1 < static_cast<float>(image.rows))) {
    return false;
  }
  const int x0 = static_cast<int>(left);
  const int y0 = static_cast<int>(top);
  const float fx = left - static_cast<float>(x0);
  const float fy = top - static_cast<float>(y0);
  const float w00 = (1 - fx) * (1 - fy);
  const float w01 = fx * (1 - fy);
  const float w10 = (1 - fx) * fy;
  const float w11 = fx * fy;
  float sum = 0.0F;
  for (int y = 0; y < kSide; ++y) {
    const std::uint8_t* upper = image.ptr<std::uint8_t>(y0 + y) + x0;
    const std::uint8_t* lower = image.ptr<std::uint8_t>(y0 + y + 1) + x0;
    for (int x = 0; x < kSide; ++x) {
      const float value = w00 * upper[x] + w01 * upper[x + 1] + w10 * lower[x] + w11 * lower[x + 1];
      patch[static_cast<std::size_t>(y * kSide + x)] = value;
      sum += value;
    }
  }
  const float mean = sum / static_cast<float>(patch.size());
  float squares = 0.0F;
  for (float& value : patch) {
    value -= mean;
    squares += value * value;
  }
  norm = std::sqrt(squares);
  return squares >= kMinDeviation * kMinDeviation * static_cast<float>(patch.size());
}

}  // namespace

double patch_correlation(const cv::Mat& a, const Eigen::Vector2f& at_a, const cv::Mat& b,
                         const Eigen::Vector2f& at_b) {
  Patch patch_a;
  Patch patch_b;
  float norm_a = 0.0F;
  float norm_b = 0.0F;
  if (!sample(a, at_a, patch_a, norm_a) || !sample(b, at_b, patch_b, norm_b)) return 0.0;
  float product = 0.0F;
  for (std::size_t i = 0; i < patch_a.size(); ++i) product += patch_a[i] * patch_b[i];
  return static_cast<double>(product / (norm_a * norm_b));
}

PatchTemplate::PatchTemplate(const cv::Mat& image, int x, int y) {
  int sum = 0;
  for (int r = 0; r < kHeight; ++r) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y - kHeight / 2 + r) + x - kWidth / 2;
    for (int c = 0; c < kWidth; ++c) {
      centred_[r * kWidth + c] = row[c];
      sum += row[c];
    }
  }
  const int mean = (sum + kPixels / 2) / kPixels;
  int squares = 0;
  for (short& value : centred_) {
    value = static_cast<short>(value - mean);
    sum_ += value;
    squares += value * value;
  }
  norm_ = std::sqrt(static_cast<float>(squares) -
                    static_cast<float>(sum_) * static_cast<float>(sum_) / kPixels);
}

bool PatchTemplate::has_contrast() const {
  return norm_ * norm_ >= kMinDeviation * kMinDeviation * kPixels;
}

float PatchTemplate::correlation(const cv::Mat& image, int x, int y) const {
  int sum = 0;
  int squares = 0;
  int product = 0;
  for (int r = 0; r < kHeight; ++r) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y - kHeight / 2 + r) + x - kWidth / 2;
    const short* mine = centred_ + r * kWidth;
    for (int c = 0; c < kWidth; ++c) {
      const short value = row[c];
      sum += value;
      squares += value * value;
      product += value * mine[c];
    }
  }
  const float mean = static_cast<float>(sum) / kPixels;
  const float variance = static_cast<float>(squares) - static_cast<float>(sum) * mean;
  if (variance < kMinDeviation * kMinDeviation * kPixels) return 0.0F;
  const float covariance = static_cast<float>(product) - static_cast<float>(sum_) * mean;
  return covariance / (norm_ * std::sqrt(variance));
}

}  // namespace km
