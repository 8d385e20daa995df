#include <algorithm>
#include <utility>

#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/window_equations.hpp"

// How the window of FixedLagSmoother moves on.
namespace km {
namespace {

constexpr double kHeldPosition_m = 1e-3;  // of the first state: fixes the gauge, no more
constexpr double kHeldHeading_rad = 1e-3;
constexpr double kGyroBiasSigma = 0.02;  // around the guess of the start [rad/s]

}  // namespace

void FixedLagSmoother::hold_first() {
  const OdometryState& first = window_.frames.front().state;
  StatePrior& prior = window_.prior;
  prior.frames = {window_.frames.front().id};
  prior.linearization = {first};
  prior.J = Eigen::MatrixXd::Zero(10, 15);
  prior.r = Eigen::VectorXd::Zero(10);
  // Heading: the rotation about the vertical, seen from the body.
  prior.J.block<1, 3>(0, 0) = first.T_odom_body.linear().row(2) / kHeldHeading_rad;
  prior.J.block<3, 3>(1, 3).diagonal().setConstant(1.0 / kHeldPosition_m);
  prior.J.block<3, 3>(4, 9).diagonal().setConstant(1.0 / kGyroBiasSigma);
  prior.J.block<3, 3>(7, 12).diagonal().setConstant(1.0 / config_.accel_bias_sigma);
}

void FixedLagSmoother::slide() {
  for (std::size_t k = window_.frames.size(); k-- > 1;) {
    const bool recent =
        k + static_cast<std::size_t>(config_.window_recent) >= window_.frames.size();
    if (!recent && !window_.frames[k].keyframe) merge_out(k);
  }
  while (keyframes() > static_cast<std::size_t>(config_.window_keyframes)) marginalize_oldest();
  const auto gone = [&](const WindowLandmark& landmark) {
    return landmark.observations.empty() ||
           (landmark.observations.size() < 2 && !tracked_now(window_, landmark));
  };
  std::erase_if(window_.landmarks, gone);
}

void FixedLagSmoother::merge_out(std::size_t frame) {
  std::vector<ImuSample> samples = std::move(window_.frames[frame].samples);
  std::vector<ImuSample>& later = window_.frames[frame + 1].samples;
  for (const ImuSample& sample : later)
    if (sample.stamp > samples.back().stamp) samples.push_back(sample);
  later = std::move(samples);
  forget_frame(frame);
  set_imu(frame);
}

void FixedLagSmoother::forget_frame(std::size_t frame) {
  window_.frames.erase(window_.frames.begin() + static_cast<std::ptrdiff_t>(frame));
  for (WindowLandmark& landmark : window_.landmarks) {
    std::erase_if(landmark.observations, [&](const auto& o) { return o.frame == frame; });
    for (WindowObservation& o : landmark.observations) o.frame -= o.frame > frame;
  }
}

void FixedLagSmoother::marginalize_oldest() {
  WindowEquations equations(window_, 0.0);
  equations.add_prior();
  equations.add_imu(1);
  std::vector<bool> involved(window_.frames.size(), false);
  involved[0] = involved[1] = true;
  for (const std::uint64_t id : window_.prior.frames) involved[frame_index(window_, id)] = true;
  for (const WindowLandmark& landmark : window_.landmarks) {
    if (!landmark.located || landmark.observations.front().frame != 0) continue;
    equations.add_landmark(landmark, true);
    for (const WindowObservation& o : landmark.observations)
      if (window_.frames[o.frame].keyframe) involved[o.frame] = true;
  }
  std::vector<Eigen::Index> variables;
  StatePrior prior;
  for (std::size_t k = 0; k < window_.frames.size(); ++k) {
    if (!involved[k]) continue;
    for (Eigen::Index v = 0; v < (k <= 1 ? 15 : 6); ++v)
      variables.push_back(15 * static_cast<Eigen::Index>(k) + v);
    if (k == 0) continue;
    prior.frames.push_back(window_.frames[k].id);
    const auto known =
        std::find(window_.prior.frames.begin(), window_.prior.frames.end(), window_.frames[k].id);
    prior.linearization.push_back(window_.frames[k].state);
    if (known != window_.prior.frames.end())
      prior.linearization.back().T_odom_body =
          window_.prior
              .linearization[static_cast<std::size_t>(known - window_.prior.frames.begin())]
              .T_odom_body;
  }
  const Eigen::MatrixXd full = equations.H().selfadjointView<Eigen::Lower>();
  const SquareRootPrior root =
      marginalize(full(variables, variables), equations.g()(variables), 15);
  prior.J = root.J;
  prior.r = root.r;
  // The gradient was taken at the current states; the prior counts from the first estimates.
  std::vector<const OdometryState*> states;
  for (const std::uint64_t id : prior.frames)
    states.push_back(&window_.frames[frame_index(window_, id)].state);
  prior.r -= prior.J * prior_offset(prior, states);
  window_.prior = std::move(prior);
  // What the prior has used must not count again.
  for (WindowLandmark& landmark : window_.landmarks) {
    if (!landmark.located || landmark.observations.front().frame != 0) continue;
    std::erase_if(landmark.observations,
                  [&](const auto& o) { return window_.frames[o.frame].keyframe; });
    landmark.located = false;
  }
  window_.frames[1].keyframe = true;  // in the prior: it can only leave by marginalisation
  forget_frame(0);
  std::erase_if(window_.landmarks, [](const auto& l) { return l.observations.empty(); });
}

}  // namespace km
