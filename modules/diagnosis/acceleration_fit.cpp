#include "modules/diagnosis/acceleration_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "modules/core/geometry/lie.hpp"
#include "modules/core/quantile.hpp"

namespace km {
namespace {

constexpr std::size_t kMinChanges = 20, kWindow = 15;  // steps
constexpr double kMaxDeviation = 4.0;                  // largest residual, in medians

// Motion of the body during a step, and the specific force in the frame at its start.
struct BodyStep {
  double s = 0.0;  // duration
  SE3 T = SE3::Identity();
  Eigen::Vector3d early = Eigen::Vector3d::Zero();  // integral of (1 - t / s) R f
  Eigen::Vector3d late = Eigen::Vector3d::Zero();   // integral of t / s R f
};

std::optional<BodyStep> body_step(const VisualRotation& seen, std::span<const ImuSample> samples,
                                  const SE3& T_body_cam, Stamp offset) {
  const Stamp from = seen.from + offset, to = seen.to + offset;
  const auto first = std::ranges::lower_bound(samples, from, {}, &ImuSample::stamp);
  const auto last = std::ranges::upper_bound(samples, to, {}, &ImuSample::stamp);
  if (!seen.translation || first == samples.begin() || last == samples.end()) return std::nullopt;
  BodyStep step{.s = seconds_between(from, to)};
  SE3 T_cam = SE3::Identity();
  T_cam.linear() = so3_exp(seen.rotation);
  T_cam.translation() = *seen.translation;
  step.T = T_body_cam * T_cam * T_body_cam.inverse();
  const Eigen::Vector3d rotation = so3_log(step.T.linear());
  for (auto sample = first; sample != last; ++sample) {
    const double share = seconds_between(from, sample->stamp) / step.s;
    const Eigen::Vector3d force = so3_exp(share * rotation) * sample->accel;
    const double dt_s = step.s / static_cast<double>(last - first);
    step.early += dt_s * (1.0 - share) * force;
    step.late += dt_s * share * force;
  }
  return step;
}

// Accelerations by the images and by the accelerometer, without the mean of their window.
struct Change {
  Eigen::Vector3d images, sensor;
};

void add_window(std::span<const BodyStep> steps, std::vector<Change>& changes) {
  if (steps.size() < 4) return;
  std::vector<Change> found;
  Change mean{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  // rotation of the step in its window
  for (std::size_t k = 0; k + 1 < steps.size(); ++k) {
    const BodyStep &a = steps[k], &b = steps[k + 1];
    const Eigen::Matrix3d R_next = R * a.T.linear();
    const double s = 0.5 * (a.s + b.s);
    found.push_back({(R_next * b.T.translation() / b.s - R * a.T.translation() / a.s) / s,
                     (R * a.late + R_next * b.early) / s});
    mean.images += found.back().images;
    mean.sensor += found.back().sensor;
    R = R_next;
  }
  const auto count = static_cast<double>(found.size());
  for (const Change& change : found)
    changes.push_back({change.images - mean.images / count, change.sensor - mean.sensor / count});
}

AccelerationFit fit(const std::vector<Change>& changes) {
  double xx = 0.0, xy = 0.0, rr = 0.0;
  for (const Change& change : changes) {
    xx += change.sensor.squaredNorm();
    xy += change.sensor.dot(change.images);
  }
  AccelerationFit result{.steps = changes.size(), .scale = xy / xx};
  for (const Change& change : changes)
    rr += (change.images - result.scale * change.sensor).squaredNorm();
  result.sigma = std::sqrt(rr / (3.0 * static_cast<double>(changes.size())) / xx);
  return result;
}

}  // namespace

std::optional<AccelerationFit> fit_acceleration(std::span<const VisualRotation> seen,
                                                std::span<const ImuSample> samples,
                                                const SE3& T_body_cam, double offset_s) {
  std::vector<Change> changes;
  std::vector<BodyStep> window;
  const auto close = [&] {
    add_window(window, changes);
    window.clear();
  };
  for (std::size_t k = 0; k < seen.size(); ++k) {
    if (k > 0 && (seen[k].from != seen[k - 1].to || window.size() >= kWindow)) close();
    const auto step = body_step(seen[k], samples, T_body_cam, nanoseconds(offset_s));
    if (step)
      window.push_back(*step);
    else
      close();
  }
  close();
  if (changes.size() < kMinChanges) return std::nullopt;
  for (int round = 0; round < 3; ++round) {
    const double scale = fit(changes).scale;
    std::vector<double> residuals;
    for (const Change& change : changes)
      residuals.push_back((change.images - scale * change.sensor).norm());
    const double limit = kMaxDeviation * quantile(residuals, 0.5);
    std::erase_if(changes, [&](const Change& change) {
      return (change.images - scale * change.sensor).norm() > limit;
    });
  }
  return changes.size() < kMinChanges ? std::nullopt : std::optional(fit(changes));
}

}  // namespace km
