#include "modules/vio/patch_alignment.hpp"

#include <Eigen/LU>
#include <cmath>
#include <cstdint>

namespace km {
namespace {

constexpr int kMaxSteps = 12;
constexpr float kSettledPx = 0.03F;    // The next step would be several times smaller.
constexpr float kMaxShiftPx = 4.0F;    // From the start: farther away lies another minimum.
constexpr float kMinDeviation = 2.0F;  // Grey levels.

}  // namespace

bool AlignmentPatch::sample(const cv::Mat& image, const Eigen::Vector2f& px,
                            const Eigen::Matrix2f& A, Samples& samples) {
  // The warped square lies in the box of its corners.
  const Eigen::Vector2f reach = static_cast<float>(kRadius) * A.cwiseAbs().rowwise().sum();
  if (!(px.x() - reach.x() >= 0.0F && px.y() - reach.y() >= 0.0F &&
        px.x() + reach.x() < static_cast<float>(image.cols - 1) &&
        px.y() + reach.y() < static_cast<float>(image.rows - 1))) {
    return false;
  }
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  Eigen::Index i = 0;
  for (int v = -kRadius; v <= kRadius; ++v) {
    float x = px.x() + A(0, 1) * static_cast<float>(v) - A(0, 0) * static_cast<float>(kRadius);
    float y = px.y() + A(1, 1) * static_cast<float>(v) - A(1, 0) * static_cast<float>(kRadius);
    for (int u = 0; u < kSide; ++u, x += A(0, 0), y += A(1, 0)) {
      const int xi = static_cast<int>(x);
      const int yi = static_cast<int>(y);
      const float fx = x - static_cast<float>(xi);
      const float fy = y - static_cast<float>(yi);
      const std::uint8_t* p = image.data + yi * step + xi;
      const float upper = static_cast<float>(p[0]) + fx * static_cast<float>(p[1] - p[0]);
      const float lower =
          static_cast<float>(p[step]) + fx * static_cast<float>(p[step + 1] - p[step]);
      samples[i++] = upper + fy * (lower - upper);
    }
  }
  samples.tail<kPadded - kPixels>().setZero();
  return true;
}

std::optional<AlignmentPatch> AlignmentPatch::cut(const cv::Mat& image, const Eigen::Vector2f& px) {
  AlignmentPatch patch;
  const Eigen::Matrix2f I = Eigen::Matrix2f::Identity();
  const auto centre = [](Samples& samples) {
    samples.head<kPixels>().array() -= samples.sum() / static_cast<float>(kPixels);
  };
  if (!sample(image, px, I, patch.values_)) return std::nullopt;
  centre(patch.values_);
  const float contrast = patch.values_.norm();
  if (contrast < kMinDeviation * std::sqrt(static_cast<float>(kPixels))) return std::nullopt;
  patch.values_ /= contrast;
  for (int axis = 0; axis < 2; ++axis) {
    Samples before;
    Samples after;
    const Eigen::Vector2f unit = I.col(axis);
    if (!sample(image, px - unit, I, before) || !sample(image, px + unit, I, after)) {
      return std::nullopt;
    }
    Samples& derivative = axis == 0 ? patch.dx_ : patch.dy_;
    derivative = (after - before) / (2.0F * contrast);
    centre(derivative);
  }
  Eigen::Matrix2f H;
  H << patch.dx_.squaredNorm(), patch.dx_.dot(patch.dy_), patch.dx_.dot(patch.dy_),
      patch.dy_.squaredNorm();
  if (H.determinant() < 1e-8F) return std::nullopt;
  patch.H_inverse_ = H.inverse();
  patch.offset_ = {patch.dx_.dot(patch.values_), patch.dy_.dot(patch.values_)};
  return patch;
}

std::optional<PatchAlignment> AlignmentPatch::align(const cv::Mat& image,
                                                    const Eigen::Vector2f& start,
                                                    const Eigen::Matrix2f& A) const {
  Samples samples;
  Eigen::Vector2f px = start;
  for (int step = 0; step < kMaxSteps; ++step) {
    if (!sample(image, px, A, samples)) return std::nullopt;
    const float mean = samples.sum() / static_cast<float>(kPixels);
    const float variance = samples.squaredNorm() / static_cast<float>(kPixels) - mean * mean;
    if (variance < kMinDeviation * kMinDeviation) return std::nullopt;
    const float scale = 1.0F / std::sqrt(variance * static_cast<float>(kPixels));
    // The patch moved by d explains the difference: values + d * gradient = samples. Mean and
    // contrast of the samples need not be taken out first, for all that they meet has zero mean.
    const float correlation = scale * values_.dot(samples);
    const Eigen::Vector2f g = scale * Eigen::Vector2f(dx_.dot(samples), dy_.dot(samples)) - offset_;
    const Eigen::Vector2f d = H_inverse_ * g;
    px -= A * d;
    if (!((px - start).squaredNorm() < kMaxShiftPx * kMaxShiftPx)) return std::nullopt;
    if (d.squaredNorm() < kSettledPx * kSettledPx) return PatchAlignment{px, correlation};
  }
  return std::nullopt;
}

}  // namespace km
