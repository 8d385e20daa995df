#include "modules/vio/patch_template.hpp"

#include <cmath>
#include <cstdint>

namespace km {
namespace {

constexpr float kMinDeviation = 1.0F;  // Grey levels; below, the patch is noise.

}  // namespace

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
