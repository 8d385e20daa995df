#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "modules/core/camera/camera.hpp"

namespace km {

/// Result of aligning a patch.
struct PatchAlignment {
  Eigen::Vector2f px = Eigen::Vector2f::Zero();
  float correlation = 0.0F;  ///< Zero-mean and normalised, in [-1, 1].
};

/// A small window of an image, prepared to be located with subpixel accuracy in other images, from
/// another viewpoint and in other light.
///
/// Inverse compositional alignment (Baker and Matthews, IJCV 2004) over the two shifts. The caller
/// supplies an affine warp from the geometry. Patches are reduced to zero mean and unit contrast.
/// In contrast to tracking from image to image, errors do not accumulate. In contrast to windows
/// without warp, errors do not grow with the disparity of near points.
class AlignmentPatch {
 public:
  /// The window around `px`; nullopt if it leaves the image or has no texture.
  [[nodiscard]] static std::optional<AlignmentPatch> cut(const cv::Mat& image,
                                                         const Eigen::Vector2f& px);

  /// Descends from `start`. `A` maps offsets in the patch to offsets in `image`: the point `d` from
  /// the patch's centre is at px + A * d. nullopt if the search leaves the image, diverges or does
  /// not converge.
  [[nodiscard]] std::optional<PatchAlignment> align(const cv::Mat& image,
                                                    const Eigen::Vector2f& start,
                                                    const Eigen::Matrix2f& A) const;

 private:
  static constexpr int kRadius = 6;
  static constexpr int kSide = 2 * kRadius + 1;
  static constexpr int kPixels = kSide * kSide;
  static constexpr int kPadded = 176;  // Zeros at the end: whole vectors for any instruction set.
  using Samples = Eigen::Matrix<float, kPadded, 1>;

  [[nodiscard]] static bool sample(const cv::Mat& image, const Eigen::Vector2f& px,
                                   const Eigen::Matrix2f& A, Samples& samples);

  Samples values_;  // Zero mean, unit norm.
  Samples dx_;      // Derivatives of values_, zero mean.
  Samples dy_;
  Eigen::Matrix2f H_inverse_ = Eigen::Matrix2f::Zero();
  Eigen::Vector2f offset_ = Eigen::Vector2f::Zero();  // Products of dx_ and dy_ with values_.
};

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

  /// Zero-mean normalised correlation with the patch around (x, y) of `image`, in [-1, 1]; 0 if the
  /// patch of `image` is flat. Precondition: covered_by(image, x, y).
  [[nodiscard]] float correlation(const cv::Mat& image, int x, int y) const;

 private:
  static constexpr int kPixels = kWidth * kHeight;
  alignas(16) short centred_[kPixels] = {};  // Grey levels minus their rounded mean.
  int sum_ = 0;                              // Sum of centred_, due to the rounding of the mean.
  float norm_ = 0.0F;
};

/// Warp of an image between viewpoints: maps small pixel offsets around the image of a landmark in
/// camera a to offsets around its image in camera b. The surface is assumed to face camera a. The
/// lens distortion of both cameras is included. `bearing_a` on z = 1, `inverse_depth` in a [1/m],
/// T_b_a between the cameras. Identity if the landmark is behind b, or at the rim of the lens'
/// field of view.
[[nodiscard]] Eigen::Matrix2f local_warp(const Camera& a, const Camera& b,
                                         const Eigen::Vector2d& bearing_a, double inverse_depth,
                                         const SE3& T_b_a);

}  // namespace km
