#pragma once

#include <opencv2/core/mat.hpp>

namespace km {

/// A patch of 16 x 11 pixels of an 8-bit image, prepared to be compared with many others.
class PatchTemplate {
 public:
  static constexpr int kWidth = 16;
  static constexpr int kHeight = 11;

  /// The patch around pixel (x, y). Precondition: covered_by(image, x, y).
  PatchTemplate(const cv::Mat& image, int x, int y);

  /// Whether the patch around (x, y) lies inside the image.
  [[nodiscard]] static bool covered_by(const cv::Mat& image, int x, int y) {
    return x >= kWidth / 2 && y >= kHeight / 2 && x + kWidth / 2 <= image.cols &&
           y + kHeight / 2 < image.rows;
  }

  /// False if the patch is too flat for any comparison to mean something.
  [[nodiscard]] bool has_contrast() const;

  /// Zero-mean normalised correlation with the patch around (x, y), in [-1, 1]; 0 if that one is
  /// flat. Precondition: covered_by(image, x, y).
  [[nodiscard]] float correlation(const cv::Mat& image, int x, int y) const;

 private:
  static constexpr int kPixels = kWidth * kHeight;
  alignas(16) short centred_[kPixels] = {};  // Grey levels minus their rounded mean.
  int sum_ = 0;                              // Of centred_: what the rounding left.
  float norm_ = 0.0F;
};

}  // namespace km
