#include "modules/diagnosis/inertial_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "modules/core/quantile.hpp"

namespace km {

GyroIntegral::GyroIntegral(std::span<const ImuSample> samples) : samples_(samples) {
  sums_.reserve(samples.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < samples.size(); ++k) {
    if (k > 0)
      sum += 0.5 * (samples[k - 1].gyro + samples[k].gyro) *
             seconds_between(samples[k - 1].stamp, samples[k].stamp);
    sums_.push_back(sum);
  }
}

bool GyroIntegral::covers(Stamp from, Stamp to) const {
  return !samples_.empty() && samples_.front().stamp <= from && to <= samples_.back().stamp;
}

Eigen::Vector3d GyroIntegral::until(Stamp stamp) const {
  const auto after = std::ranges::upper_bound(samples_, stamp, {}, &ImuSample::stamp);
  const auto k =
      static_cast<std::size_t>(std::min(after, samples_.end() - 1) - samples_.begin() - 1);
  const ImuSample &a = samples_[k], &b = samples_[k + 1];
  const double s = seconds_between(a.stamp, stamp), step_s = seconds_between(a.stamp, b.stamp);
  return sums_[k] + s * (a.gyro + 0.5 * s / step_s * (b.gyro - a.gyro));
}

namespace {

constexpr std::size_t kMinSteps = 20;
constexpr double kCoarse_s = 5e-3, kFine_s = 1e-3;
constexpr double kTrusted = 0.8;       // share of the steps used for the first offset
constexpr double kMaxDeviation = 4.0;  // largest residual of a trusted step, in medians

using Rates = Eigen::Matrix3Xd;

Rates image_rates(std::span<const VisualRotation> seen) {
  Rates rates(3, static_cast<Eigen::Index>(seen.size()));
  for (Eigen::Index k = 0; k < rates.cols(); ++k) {
    const VisualRotation& step = seen[static_cast<std::size_t>(k)];
    rates.col(k) = step.rotation / seconds_between(step.from, step.to);
  }
  return rates;
}

Rates gyro_rates(const GyroIntegral& gyro, std::span<const VisualRotation> seen, double offset_s) {
  const Stamp offset = nanoseconds(offset_s);
  Rates rates(3, static_cast<Eigen::Index>(seen.size()));
  for (Eigen::Index k = 0; k < rates.cols(); ++k) {
    const VisualRotation& step = seen[static_cast<std::size_t>(k)];
    rates.col(k) = gyro.mean(step.from + offset, step.to + offset);
  }
  return rates;
}

// Squared residuals, per step, of the best affine map from gyroscope rates to image rates.
Eigen::VectorXd residuals(const Rates& image, const Rates& gyro) {
  Eigen::Matrix4Xd inputs(4, gyro.cols());
  inputs << gyro, Eigen::RowVectorXd::Ones(gyro.cols());
  const Eigen::Matrix4d normal = inputs * inputs.transpose() + 1e-12 * Eigen::Matrix4d::Identity();
  const Eigen::Matrix<double, 3, 4> map =
      normal.ldlt().solve(inputs * image.transpose()).transpose();
  return (image - map * inputs).colwise().squaredNorm();
}

double trimmed_sum(Eigen::VectorXd squares) {
  const auto kept = static_cast<std::ptrdiff_t>(kTrusted * static_cast<double>(squares.size()));
  std::nth_element(squares.data(), squares.data() + kept, squares.data() + squares.size());
  return squares.head(kept).sum();
}

double coarse_offset(const GyroIntegral& gyro, std::span<const VisualRotation> seen,
                     const Rates& image) {
  double best_s = 0.0, least = std::numeric_limits<double>::infinity();
  const auto most = static_cast<int>(std::lround(kMaxOffset_s / kCoarse_s));
  for (int k = -most; k <= most; ++k) {
    const double offset_s = kCoarse_s * k;
    const double sum = trimmed_sum(residuals(image, gyro_rates(gyro, seen, offset_s)));
    if (sum < least) best_s = offset_s;
    least = std::min(least, sum);
  }
  return best_s;
}

// The steps whose residual at `offset_s` is at most kMaxDeviation times the median.
std::vector<VisualRotation> trusted(const GyroIntegral& gyro, std::span<const VisualRotation> seen,
                                    double offset_s) {
  const Eigen::VectorXd squares = residuals(image_rates(seen), gyro_rates(gyro, seen, offset_s));
  const double median =
      quantile(std::vector<double>(squares.data(), squares.data() + squares.size()), 0.5);
  std::vector<VisualRotation> kept;
  for (std::size_t k = 0; k < seen.size(); ++k)
    if (squares[static_cast<Eigen::Index>(k)] <= kMaxDeviation * kMaxDeviation * median)
      kept.push_back(seen[k]);
  return kept;
}

// The offset with the smallest sum of squares near `start_s`, by a parabola through its neighbours.
void refine_offset(const GyroIntegral& gyro, std::span<const VisualRotation> seen,
                   const Rates& image, double start_s, InertialFit& fit) {
  const auto sum_at = [&](double offset_s) {
    return residuals(image, gyro_rates(gyro, seen, offset_s)).sum();
  };
  double at_s = start_s, sum = sum_at(start_s);
  const auto most = static_cast<int>(std::lround(2.0 * kCoarse_s / kFine_s));
  for (int k = -most; k <= most; ++k) {
    const double s = start_s + kFine_s * k, here = sum_at(s);
    if (here >= sum) continue;
    at_s = s;
    sum = here;
  }
  // A width of kCoarse_s, so that noise does not determine the parabola.
  const double before = sum_at(at_s - kCoarse_s), after = sum_at(at_s + kCoarse_s);
  const double curvature = (before - 2.0 * sum + after) / (kCoarse_s * kCoarse_s);
  fit.offset_at_limit = std::abs(start_s) > kMaxOffset_s - 1.5 * kCoarse_s || !(curvature > 0.0);
  fit.offset_s = at_s;
  if (!(curvature > 0.0)) return;
  fit.offset_s +=
      std::clamp((before - after) / (2.0 * kCoarse_s * curvature), -kCoarse_s, kCoarse_s);
  const double variance = sum / std::max(1.0, 3.0 * static_cast<double>(seen.size()) - 12.0);
  fit.offset_sigma_s = std::sqrt(2.0 * variance / curvature);
}

Rates centred(const Rates& rates) {
  return rates.colwise() - rates.rowwise().mean();
}

void fit_rotation(const Rates& image, const Rates& gyro, InertialFit& fit) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(image * gyro.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  fit.Q = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Vector3d& gains = svd.singularValues();
  fit.scale = gains.sum() / gyro.squaredNorm();
  // With the nearest rotation instead of a reflection, the sum decreases by twice the smallest
  // gain.
  const double of_all = gains.sum() * gains.sum();
  const double of_rotation = std::pow(gains.sum() - 2.0 * gains[2], 2);
  if (fit.Q.determinant() < 0.0)
    fit.mirror_gain =
        (of_all - of_rotation) / (gyro.squaredNorm() * std::max(image.squaredNorm(), 1e-12));
}

// If the body hardly turns about some axis, the sign of this axis is undetermined. The proper
// rotation then replaces the mirrored solution.
void prefer_rotation(InertialFit& fit, const Rates& image, const Rates& gyro) {
  constexpr double kClearMirror = 0.02;
  if (fit.Q.determinant() > 0.0 || fit.mirror_gain > kClearMirror) return;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(image * gyro.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  fit.Q = svd.matrixU() * Eigen::Vector3d(1.0, 1.0, -1.0).asDiagonal() * svd.matrixV().transpose();
  fit.scale = (svd.singularValues().head<2>().sum() - svd.singularValues()[2]) / gyro.squaredNorm();
  fit.mirror_gain = 0.0;
}

}  // namespace

std::optional<InertialFit> fit_inertial(std::span<const VisualRotation> seen,
                                        std::span<const ImuSample> samples) {
  const GyroIntegral gyro(samples);
  const Stamp reach = nanoseconds(kMaxOffset_s + 3.0 * kCoarse_s);
  std::vector<VisualRotation> covered;
  for (const VisualRotation& step : seen)
    if (gyro.covers(step.from - reach, step.to + reach)) covered.push_back(step);
  if (covered.size() < kMinSteps) return std::nullopt;
  const double start_s = coarse_offset(gyro, covered, image_rates(covered));
  const std::vector<VisualRotation> kept = trusted(gyro, covered, start_s);

  InertialFit fit{.steps = kept.size()};
  const Rates all = image_rates(kept);
  refine_offset(gyro, kept, all, start_s, fit);
  const Rates measured = gyro_rates(gyro, kept, fit.offset_s);
  const Rates image = centred(all), turns = centred(measured);
  const auto n = static_cast<double>(kept.size());
  fit.image_rms = std::sqrt(image.squaredNorm() / n);
  const Eigen::Matrix3d covariance = turns * turns.transpose() / n;
  fit.gyro_rms = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance)
                     .eigenvalues()
                     .reverse()
                     .cwiseMax(0.0)
                     .cwiseSqrt();
  fit.explained = 1.0 - residuals(image, turns).sum() / std::max(image.squaredNorm(), 1e-12);
  fit_rotation(image, turns, fit);
  prefer_rotation(fit, image, turns);
  fit.constant = (all - fit.scale * fit.Q * measured).rowwise().mean();
  return fit;
}

}  // namespace km
