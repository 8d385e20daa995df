#include "modules/vio/vio.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "modules/core/camera/depth_lookup.hpp"
#include "modules/core/data/covariance.hpp"
#include "modules/core/data/imu_limits.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/vio/keyframe_rule.hpp"

namespace km {
namespace {

// Largest lead of a sample over its image; a wrong stamp would block all later samples.
constexpr double kMaxAhead_s = 1.0;
constexpr double kMaxCostPerLandmark = 100.0;  // a hundred times that of a usable fit
// A larger estimated bias shows that the estimate has diverged.
constexpr double kMaxAccelBias_mps2 = 3.0;

// After this time without a successful start, the oldest images held back are dropped.
constexpr double kStartTimeout_s = 3.0;

// Number of keyframes in a row whose verticals share one error, because biases change slowly. The
// optimiser treats the errors as independent, so each vertical gets the root of this times
// VioConfig::tilt_sigma.
constexpr double kTiltKeyframes = 120.0;

// An image contradicts the estimate if it has at least kMinStereoFeatures features with a right
// observation, but the window has fewer located landmarks than 1 / kMaxFeaturesPerLandmark of these
// features. Normally there are more landmarks than features. The estimate is wrong if more than
// kMostUnlocatedImages images in a row contradict it.
constexpr std::ptrdiff_t kMinStereoFeatures = 40;
constexpr std::ptrdiff_t kMaxFeaturesPerLandmark = 4;
constexpr int kMostUnlocatedImages = 10;

// After a loss of vision of at least kLongLoss_s the smoother discards the prior that was formed
// during the loss, kRecovered_s after vision is back. By then images have corrected the states of
// the loss.
constexpr double kLongLoss_s = 3.0;
constexpr double kRecovered_s = 0.8;

// Conditions for bridging a gap of inertial samples by images alone: least number of tracked
// features and longest gap.
constexpr int kLeastTracked = 30;
constexpr double kLongestBridge_s = 3.0;

// Longest time between two samples; infinite without samples.
double longest_step_s(const std::vector<ImuSample>& samples) {
  if (samples.empty()) return std::numeric_limits<double>::infinity();
  double longest_s = 0.0;
  for (std::size_t k = 1; k < samples.size(); ++k)
    longest_s = std::max(longest_s, seconds_between(samples[k - 1].stamp, samples[k].stamp));
  return longest_s;
}

// Ratio of the variance of a motion to that of WindowEquations::error_ratio(), for errors that all
// landmarks share. Chosen on these flights, on halves of MH_01 and on the room of apps/demo. Images
// were rendered at 376x240 and 20 Hz along 30 s of the flights V1_02 and V2_03. With this ratio,
// the mean normalised squared error over 1, 5 and 20 keyframes is 0.6, 1.5, 0.8 and 0.9, 1.8, 2.2.
constexpr double kCommonErrors = 2.0;

constexpr double kLeastTiltSigma = 1e-4;  // [rad]; no inertial sensor is more accurate
constexpr double kMostTiltSigma = 1.5;    // a larger uncertainty means that the vertical is unknown

}  // namespace

Vio::Vio(RobotId robot, const SensorRig& rig, const TrackerConfig& tracker, const VioConfig& config)
    : robot_(robot),
      rig_(rig),
      model_(motion_model(rig, config)),
      readout_s_(tracker.readout_s),
      tracker_(rig.stereo, tracker, rig.has_imu),
      rest_detector_(model_.config, rig.stereo.cameras[0].fx),
      vision_(model_.vision_patience_s) {
  statistics_.has_imu = rig.has_imu;
}

void Vio::continue_from(const VioCheckpoint& checkpoint) {
  last_ = checkpoint.state;
  last_keyframe_ = checkpoint.keyframe;
  T_chain_odom_ = last_ ? checkpoint.keyframe.T_odom_kf * last_->T_odom_body.inverse()
                        : chain_of_next_run(checkpoint.keyframe);
  learned_.calibration = checkpoint.keyframe.calibration;
}

VioResult Vio::process(const SensorPacket& packet) {
  VioResult result;
  const int refused = model_.is_measured ? take_samples(packet) : 0;
  drop_old_samples();
  if (refused > 0) result.problem = VioProblem::kBadSamples;
  statistics_.refused_samples += refused;
  const Frame& frame = packet.frame;
  const bool usable = frame != nullptr && fits(*frame, rig_.stereo);
  if (!usable || (last_image_ && frame->stamp <= *last_image_)) {
    result.problem = usable ? VioProblem::kUnorderedImage : VioProblem::kNoImage;
    ++statistics_.refused_images;
    return result;
  }
  ++statistics_.images;
  const Stamp before = last_image_.value_or(frame->stamp);
  if (!model_.is_measured) samples_ = virtual_samples(before, frame->stamp);
  Held held;
  held.frame = frame;
  held.data.samples = samples_since(before, frame->stamp);
  const double gap_s = longest_step_s(held.data.samples);
  held.data.tracked = tracker_.track(*frame, turn(held.data.samples, before, frame->stamp));
  result.tracking = tracker_.statistics();
  for (const TrackedFeature& feature : held.data.tracked.features)
    result.tracked.push_back(feature.left);
  const int features = static_cast<int>(held.data.tracked.features.size());
  const bool first = !last_image_.has_value();
  const bool paused = seconds_between(before, frame->stamp) > model_.longest_pause_s;
  last_image_ = frame->stamp;

  held.data.is_bridged = !first && !paused && gap_s > model_.config.max_imu_gap_s;
  statistics_.gaps += held.data.is_bridged && !in_gap_;
  in_gap_ = held.data.is_bridged;
  if (in_gap_) result.problem = VioProblem::kInertialGap;
  if (paused) result.problem = VioProblem::kPause;
  if (paused || (in_gap_ && !takes_over(result.tracking, gap_s))) {
    held.data.samples.clear();
    restart(std::move(held));
  } else if (first && can_continue_at(held)) {
    continue_at(held, result);
  } else if (smoother_) {
    advance(held, result);
  } else {
    held_.push_back(std::move(held));
    try_start(result);
  }
  if (!result.states.empty()) last_ = result.states.back();
  watch_vision(frame->stamp, features, result);
  return result;
}

int Vio::take_samples(const SensorPacket& packet) {
  int refused = 0;
  for (const ImuSample& sample : packet.imu) {
    const bool repeated = !samples_.empty() && sample.stamp == samples_.back().stamp;
    if (repeated) continue;  // border sample of two packets
    const bool future =
        packet.frame != nullptr && seconds_between(packet.frame->stamp, sample.stamp) > kMaxAhead_s;
    if (future || !is_plausible(sample) ||
        (!samples_.empty() && sample.stamp < samples_.back().stamp))
      ++refused;
    else
      samples_.push_back(sample);
  }
  return refused;
}

// Keeps the samples from the last one at or before the last image on, but at most those of the
// longest pause.
void Vio::drop_old_samples() {
  if (samples_.empty() || !model_.is_measured) return;
  Stamp needed = samples_.back().stamp - nanoseconds(model_.longest_pause_s);
  if (last_image_) needed = std::max(needed, *last_image_);
  const auto later = std::ranges::upper_bound(samples_, needed, {}, &ImuSample::stamp);
  if (later != samples_.begin()) samples_.erase(samples_.begin(), std::prev(later));
}

// Samples from the last one at or before `last` to the first one at or after `now`. Empty if no
// sample is at or before `last`.
std::vector<ImuSample> Vio::samples_since(Stamp last, Stamp now) const {
  std::vector<ImuSample> covering;
  for (std::size_t k = 0; k < samples_.size(); ++k) {
    const bool before = k + 1 < samples_.size() && samples_[k + 1].stamp <= last;
    const bool after = k > 0 && samples_[k - 1].stamp >= now;
    if (!before && !after) covering.push_back(samples_[k]);
  }
  if (covering.empty() || covering.front().stamp > last) return {};
  if (covering.back().stamp < now) {  // the last sample is held until the image
    covering.push_back(covering.back());
    covering.back().stamp = now;
  }
  return covering;
}

// True if images can carry the motion over a gap of the samples.
bool Vio::takes_over(const TrackerStatistics& tracking, double gap_s) const {
  return smoother_ && tracking.tracked >= kLeastTracked && gap_s <= kLongestBridge_s;
}

Eigen::Matrix3d Vio::turn(const std::vector<ImuSample>& samples, Stamp from, Stamp to) const {
  ImuPreintegration imu(rig_.imu, last_ ? last_->gyro_bias : Eigen::Vector3d::Zero(),
                        Eigen::Vector3d::Zero());
  return imu.add(samples, from, to) ? imu.motion().dR : Eigen::Matrix3d::Identity();
}

bool Vio::can_continue_at(const Held& held) const {
  const Stamp stamp = held.frame->stamp;
  return last_ && last_keyframe_->state_covariance && last_keyframe_->stamp == stamp &&
         last_->stamp == stamp;
}

// Starts odometry on the image of the checkpoint (see continue_from()), from the state that an
// earlier process has published. Precondition: can_continue_at(held).
void Vio::continue_at(const Held& held, VioResult& result) {
  start_on(held, *last_, *last_keyframe_->state_covariance);
  ++statistics_.start_attempts;
  ++statistics_.starts;
  result.start = StartStatus::kContinues;
  seen_ = last_->stamp;
  locate(*last_, held.frame, result);
}

void Vio::start_on(const Held& held, const OdometryState& state,
                   const StateCovariance& covariance) {
  InertialFrame frame = held.data;
  frame.samples = samples_;  // includes samples from before the image
  end_window();
  smoother_.emplace(rig_, model_, learned_).start(frame, state, covariance);
}

void Vio::end_window() {
  if (smoother_) learned_ = smoother_->learned();
  smoother_.reset();
}

void Vio::try_start(VioResult& result) {
  while (!held_.empty() &&
         !locates_points(*held_.front().frame)) {  // no start is possible on these
    held_.erase(held_.begin());
    ++statistics_.images_without_pose;
  }
  if (held_.empty()) return;
  if (!model_.is_measured) {
    statistics_.images_without_pose += static_cast<int>(held_.size()) - 1;
    held_.erase(held_.begin(), std::prev(held_.end()));
  }
  const double span_s =
      seconds_between(held_.front().data.tracked.stamp, held_.back().data.tracked.stamp);
  if (span_s < model_.config.start_s - 1e-3) return;
  ++statistics_.start_attempts;
  std::vector<InertialFrame> frames;
  for (const Held& held : held_) frames.push_back(held.data);
  StartGuess guess = model_.is_measured ? guess_start(frames, rig_, model_.config)
                                        : guess_start_by_images(frames.back(), rig_);
  result.start = guess.status;
  if (started(guess.status)) {
    continue_from_last_pose(guess.states);
    smoother_.emplace(rig_, model_, learned_);
    if (const auto states = smoother_->start(frames, guess.states)) {
      ++statistics_.starts;
      result.states = *states;
      seen_ = states->back().stamp;
      continue_or_add_first_keyframe(result);
      locate(states->front(), held_.front().frame, result);
      for (std::size_t k = 1; k < held_.size(); ++k) {
        if (smoother_->window().frames[k].keyframe && due((*states)[k], *held_[k].frame))
          add_keyframe((*states)[k], result);
        locate((*states)[k], held_[k].frame, result);
      }
      held_.clear();
      // States up to the last published one are final and are not published again.
      std::erase_if(result.states,
                    [this](const auto& s) { return last_ && s.stamp <= last_->stamp; });
      return;
    }
    smoother_.reset();
    result.start = StartStatus::kInconsistent;
  }
  if (span_s < kStartTimeout_s) return;
  result.problem = VioProblem::kStartTimeout;
  while (seconds_between(held_.front().data.tracked.stamp, held_.back().data.tracked.stamp) >
         0.5 * model_.config.start_s) {
    held_.erase(held_.begin());
    ++statistics_.images_without_pose;
  }
}

// A start defines its own first position and heading. The heading of the last pose replaces this
// heading, or without gravity its attitude. The new position follows from the last pose and the
// velocities before and after the interval without measurements.
void Vio::continue_from_last_pose(std::vector<OdometryState>& states) const {
  if (!last_) return;
  const SE3 first = states.front().T_odom_body;
  // Rotation about the vertical that minimises the difference of the two attitudes.
  const Eigen::Matrix3d Q = last_->T_odom_body.linear() * first.linear().transpose();
  const double turn = std::atan2(Q(1, 0) - Q(0, 1), Q(0, 0) + Q(1, 1));
  const Eigen::Matrix3d R = model_.is_measured ? so3_exp(turn * Eigen::Vector3d::UnitZ()) : Q;
  const double coasting = coasting_s(unmeasured_s(states.front().stamp));
  const Eigen::Vector3d way = coasting * (last_->v_odom + R * states.front().v_odom);
  const SE3 T = make_pose(R, last_->T_odom_body.translation() + way - R * first.translation());
  for (OdometryState& state : states) {
    state.T_odom_body = T * state.T_odom_body;
    state.v_odom = R * state.v_odom;
  }
}

void Vio::advance(const Held& held, VioResult& result) {
  const bool rested = smoother_->window().frames.back().rests;
  const bool rests = rest_detector_.add(held.data, *last_);
  statistics_.rests += rests && !rested;
  if (rests) rested_s_ += seconds_between(last_->stamp, held.frame->stamp);
  result.smoother = smoother_->add(held.data, rests);
  const bool contradicted = is_contradicted(*held.frame, held.data.tracked, *result.smoother);
  if (contradicted || !plausible(*result.smoother)) {
    ++statistics_.divergences;
    statistics_.contradictions += contradicted;
    result.problem = contradicted ? VioProblem::kContradicted : VioProblem::kDiverged;
    last_->v_odom.setZero();  // unknown after the divergence
    restart(held);
    return;
  }
  if (is_lost(held.frame->stamp, *result.smoother)) {
    result.problem = VioProblem::kLost;
    last_->gyro_bias.setZero();  // the angular rate does not persist
    restart(held);
    return;
  }
  result.states.push_back(result.smoother->state);
  const bool last_chance = last_keyframe_ && smoother_->leaves_next(last_keyframe_->stamp);
  const bool recovered = has_recovered(*held.frame);
  if (recovered ||
      (result.smoother->keyframe && (last_chance || due(result.smoother->state, *held.frame))))
    add_keyframe(result.smoother->state, result);
  if (recovered) discard_prior(held, result.smoother->state);
  locate(result.smoother->state, held.frame, result);
}

// True if the pose would be extrapolated for too long, because there is no inertial sensor.
bool Vio::is_lost(Stamp now, const SmootherUpdate& update) {
  if (update.seen >= VisionWatch::kMinLandmarks) seen_ = now;
  return seconds_between(seen_, now) > model_.longest_coast_s;
}

bool Vio::has_recovered(const StereoFrame& frame) const {
  return vision_back_since_ && seconds_between(*vision_back_since_, frame.stamp) >= kRecovered_s &&
         locates_points(frame) && !smoother_->window().frames.back().rests;
}

// Restarts the smoother at `state` without its prior. States during a loss of vision have large
// errors, and so have the derivatives of the prior at them. With this prior the smoother would move
// the pose for seconds. Without it, estimated motions are right at once, but the position error
// from the loss remains.
void Vio::discard_prior(const Held& held, const OdometryState& state) {
  vision_back_since_.reset();
  if (last_keyframe_->state_covariance) start_on(held, state, *last_keyframe_->state_covariance);
}

// An image on which a start succeeded counts as an image that holds the pose (see VisionWatch).
void Vio::watch_vision(Stamp stamp, int features, VioResult& result) {
  const bool has_started = result.start && started(*result.start);
  const int seen = has_started                    ? VisionWatch::kMinLandmarks
                   : result.smoother && smoother_ ? result.smoother->seen
                                                  : 0;
  result.vision = vision_.add(stamp, features, seen);
  if (has_started || vision_.is_lost())
    vision_back_since_.reset();
  else if (result.vision && result.vision->lasted_s >= kLongLoss_s)
    vision_back_since_ = stamp;
  statistics_.vision_losses = vision_.losses();
  statistics_.blind_s = vision_.lost_s();
}

// True if images contradict the estimate: by the errors of located landmarks, or because hardly any
// feature fits a landmark. Images are not judged while the estimate recovers from a loss of vision.
bool Vio::is_contradicted(const StereoFrame& frame, const TrackedFrame& tracked,
                          const SmootherUpdate& update) {
  if (!vision_.is_lost() && !vision_back_since_) estimate_watch_.add(update.fit);
  if (locates_points(frame)) {
    const auto locatable = std::ranges::count_if(
        tracked.features, [](const auto& feature) { return feature.right.has_value(); });
    const bool is_unlocated =
        locatable >= kMinStereoFeatures && kMaxFeaturesPerLandmark * update.landmarks < locatable;
    unlocated_images_ = is_unlocated ? unlocated_images_ + 1 : 0;
  }
  return estimate_watch_.is_contradicted() || unlocated_images_ > kMostUnlocatedImages;
}

bool Vio::plausible(const SmootherUpdate& update) const {
  const OdometryState& s = update.state;
  if (!update.solution.usable || !s.T_odom_body.matrix().allFinite() || !s.v_odom.allFinite())
    return false;
  const double allowed = kMaxCostPerLandmark * (50.0 + update.landmarks);
  return update.solution.final_cost < allowed && s.v_odom.norm() < model_.config.max_speed_mps &&
         s.gyro_bias.norm() < model_.max_gyro_bias_radps &&
         s.accel_bias.norm() < kMaxAccelBias_mps2;
}

void Vio::restart(Held held) {
  statistics_.images_without_pose += static_cast<int>(held_.size());
  end_window();
  unlocated_images_ = 0;
  estimate_watch_ = {};
  held_.clear();
  held_.push_back(std::move(held));
}

// Live odometry refines the recent keyframes after they were published; the chain of published
// keyframes does not change.
void Vio::locate(const OdometryState& state, const Frame& frame, VioResult& result) {
  if (const WindowFrame* keyframe = smoother_->frame_at(last_keyframe_->stamp))
    T_chain_odom_ = last_keyframe_->T_odom_kf * keyframe->state.T_odom_body.inverse();
  const CameraCalibration& calibration = smoother_->window().calibration;
  LocatedFrame& located = result.frames.emplace_back();
  located.frame = frame;
  located.keyframe = last_keyframe_->id.index;
  located.T_odom_body = T_chain_odom_ * state.T_odom_body;
  located.T_body_rig = calibration.T_body_rig;
  located.readout_s = readout_s_ + calibration.readout_s;
  if (const WindowFrame* newest = smoother_->frame_at(state.stamp))
    located.twist_body << newest->gyro - state.gyro_bias,
        state.T_odom_body.linear().transpose() * state.v_odom;
}

bool Vio::locates_points(const StereoFrame& frame) const {
  return rig_.stereo.depth_source == DepthSource::kRightImage || frame.depth != nullptr;
}

bool Vio::due(const OdometryState& state, const StereoFrame& frame) const {
  // A keyframe without points cannot close a loop; wait for a better image.
  if (!locates_points(frame)) return false;
  const double dt = moved_s(state.stamp);
  const WindowFrame* previous = smoother_->frame_at(last_keyframe_->stamp);
  if (previous == nullptr) return dt >= model_.config.output_interval_s - 1e-3;
  return is_keyframe_due(model_.config, dt,
                         previous->state.T_odom_body.inverse() * state.T_odom_body);
}

// Not negative, even if the clock was set back since an earlier process.
double Vio::unmeasured_s(Stamp stamp) const {
  return std::max(seconds_between(last_->stamp, stamp), 0.0);
}

// Time in motion since the last keyframe.
double Vio::moved_s(Stamp stamp) const {
  return seconds_between(last_keyframe_->stamp, stamp) - rested_s_;
}

std::optional<UncertainCalibration> Vio::known_calibration() const {
  if (!model_.config.calibrate) return std::nullopt;
  const UncertainCalibration known = smoother_->calibration();
  return known.covariance.allFinite() ? std::optional(known) : std::nullopt;
}

std::optional<Vertical> Vio::vertical_at(const OdometryState& state) const {
  const double sigma_rad = model_.config.tilt_sigma * std::sqrt(kTiltKeyframes);
  if (model_.config.tilt_sigma < kLeastTiltSigma || sigma_rad > kMostTiltSigma) return std::nullopt;
  return Vertical{state.T_odom_body.linear().transpose() * Eigen::Vector3d::UnitZ(), sigma_rad};
}

std::optional<StateCovariance> Vio::state_covariance_at(const OdometryState& state) const {
  const auto covariance = smoother_->state_covariance(state.stamp);
  return covariance && is_usable(*covariance) ? covariance : std::nullopt;
}

// Adds no keyframe if the first image is that of the last keyframe, which was published earlier.
void Vio::continue_or_add_first_keyframe(VioResult& result) {
  const OdometryState& first = result.states.front();
  if (!last_keyframe_ || last_keyframe_->stamp != first.stamp) add_first_keyframe(first, result);
}

void Vio::add_first_keyframe(const OdometryState& state, VioResult& result) {
  KeyframeOdometry keyframe;
  keyframe.T_odom_kf = T_chain_odom_ * state.T_odom_body;
  keyframe.T_previous_kf = keyframe.T_odom_kf;
  keyframe.id = {robot_, 0};
  if (last_keyframe_) {  // after a restart of the odometry
    keyframe.id.index = last_keyframe_->id.index + 1;
    keyframe.T_previous_kf = last_keyframe_->T_odom_kf.inverse() * keyframe.T_odom_kf;
    std::optional<Eigen::Vector3d> up_body;
    if (model_.is_measured)
      up_body = state.T_odom_body.linear().transpose() * Eigen::Vector3d::UnitZ();
    keyframe.covariance =
        last_
            ? restart_covariance({.lasts_s = unmeasured_s(state.stamp),
                                  .speed_mps = std::max(last_->v_odom.norm(), state.v_odom.norm()),
                                  .up_body = up_body})
            : unknown_step_covariance(up_body);
  }
  publish(keyframe, state, result);
}

// The step is not refined while its keyframes stay in the window. ATE of optimised keyframes with
// (and without) that: MH_01 5.0 (5.0) mm, TartanAir's hospital 15.6 (14.6) mm. The kitchen has 45.8
// (46.5) mm, desk_c 32.6 (26.1) mm.
void Vio::add_keyframe(const OdometryState& state, VioResult& result) {
  const auto relative = smoother_->relative_pose(last_keyframe_->stamp, state.stamp);
  const double factor =
      relative ? kCommonErrors * std::max(relative->error_ratio, model_.least_error_ratio) : 1.0;
  KeyframeOdometry keyframe;
  keyframe.id = {robot_, last_keyframe_->id.index + 1};
  keyframe.T_previous_kf =
      relative ? relative->T
               : last_keyframe_->T_odom_kf.inverse() * T_chain_odom_ * state.T_odom_body;
  keyframe.covariance =
      relative ? keyframe_covariance(model_.config, moved_s(state.stamp), factor * relative->Sigma)
               : restart_covariance();
  if (!model_.is_measured)
    keyframe.covariance += calibration_covariance(keyframe.T_previous_kf, rig_.stereo.depth_source);
  keyframe.T_odom_kf = last_keyframe_->T_odom_kf * keyframe.T_previous_kf;
  publish(keyframe, state, result);
}

// Adds the fields that depend on the state alone.
void Vio::publish(KeyframeOdometry keyframe, const OdometryState& state, VioResult& result) {
  keyframe.stamp = state.stamp;
  keyframe.vertical = vertical_at(state);
  keyframe.state_covariance = state_covariance_at(state);
  keyframe.calibration = known_calibration();
  last_keyframe_ = keyframe;
  rested_s_ = 0.0;
  result.keyframes.push_back(std::move(keyframe));
}

}  // namespace km
