#include "modules/vio/patches.hpp"

#include <Eigen/LU>
#include <cmath>
#include <cstdint>

namespace km {
namespace {

constexpr int kMaxSteps = 12;
constexpr float kSettledPx = 0.03F;    // Length of a step that ends the iteration.
constexpr float kMaxShiftPx = 4.0F;    // Largest distance from the start.
constexpr float kMinDeviation = 2.0F;  // Least standard deviation of a patch [grey levels].
constexpr float kNoise = 1.0F;         // Standard deviation that noise can have [grey levels].

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
    // The shift d of the patch explains the difference: values + d * gradient = samples. The mean
    // of the samples need not be removed, because values_, dx_ and dy_ have zero mean.
    const float correlation = scale * values_.dot(samples);
    const Eigen::Vector2f g = scale * Eigen::Vector2f(dx_.dot(samples), dy_.dot(samples)) - offset_;
    const Eigen::Vector2f d = H_inverse_ * g;
    px -= A * d;
    if (!((px - start).squaredNorm() < kMaxShiftPx * kMaxShiftPx)) return std::nullopt;
    if (d.squaredNorm() < kSettledPx * kSettledPx) return PatchAlignment{px, correlation};
  }
  return std::nullopt;
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
  return norm_ * norm_ >= kNoise * kNoise * kPixels;
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
  if (variance < kNoise * kNoise * kPixels) return 0.0F;
  const float covariance = static_cast<float>(product) - static_cast<float>(sum_) * mean;
  return covariance / (norm_ * std::sqrt(variance));
}

Eigen::Matrix2f local_warp(const Camera& a, const Camera& b, const Eigen::Vector2d& bearing_a,
                           double inverse_depth, const SE3& T_b_a) {
  const auto in_b = [&](const Eigen::Vector2d& bearing) {
    return Eigen::Vector3d(T_b_a.linear() * bearing.homogeneous() +
                           inverse_depth * T_b_a.translation());
  };
  if (in_b(bearing_a).z() < 1e-3) return Eigen::Matrix2f::Identity();
  constexpr double kStep = 2e-3;  // About a pixel.
  Eigen::Matrix2d J_a;
  Eigen::Matrix2d J_b;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
    const Eigen::Vector2d plus = bearing_a + step;
    const Eigen::Vector2d minus = bearing_a - step;
    const auto a_plus = a.project(plus), a_minus = a.project(minus);
    const auto b_plus = b.project_ray(in_b(plus)), b_minus = b.project_ray(in_b(minus));
    if (!a_plus || !a_minus || !b_plus || !b_minus) return Eigen::Matrix2f::Identity();
    J_a.col(axis) = *a_plus - *a_minus;
    J_b.col(axis) = *b_plus - *b_minus;
  }
  return (J_b * J_a.inverse()).cast<float>();
}

}  // namespace km
