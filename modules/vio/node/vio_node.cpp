#include "modules/vio/node/vio_node.hpp"

#include <array>
#include <optional>
#include <string>
#include <utility>

#include "modules/core/io/text_table.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueuedPackets = 4;  // 0.2 s at 20 Hz

const char* text(VioProblem problem) {
  switch (problem) {
    case VioProblem::kNone:
      return "no problem";
    case VioProblem::kNoImage:
      return "packet without images of the right size, refused";
    case VioProblem::kUnorderedImage:
      return "image not later than the one before, refused";
    case VioProblem::kBadSamples:
      return "inertial samples out of order or beyond what sensors measure, refused";
    case VioProblem::kInertialGap:
      return "gap in the inertial samples: the motion is estimated from images alone, or odometry "
             "starts again";
    case VioProblem::kPause:
      return "long pause of the images: odometry starts again from the last pose";
    case VioProblem::kDiverged:
      return "estimate diverged, starting again from the last pose";
    case VioProblem::kContradicted:
      return "images contradict the estimate: the recent poses are wrong, starting again "
             "from the last pose. If it repeats: check calibration and stamps by "
             "kimera_multi_doctor, light and exposure, then the keys under 'Odometry is bad' in "
             "apps/robot/odometry.md";
    case VioProblem::kLost:
      return "images do not determine the pose, and there is no inertial sensor: starting again "
             "from the last pose when they do";
    case VioProblem::kJumped:
      return "the odometry jumps faster than vio.max_speed_mps";
    case VioProblem::kStartTimeout:
      return "cannot start, giving up the oldest images held back";
  }
  return "unknown problem";
}

const char* text(StartStatus status) {
  constexpr std::array kTexts = {
      "started at rest",
      "started in motion",
      "continues from the last keyframe",
      "started without gravity, so that z of odom is not the vertical,",
      "too few images to start",
      "too few features to start",
      "stereo and inertial data disagree, no start"};  // in the order of StartStatus
  return kTexts.at(static_cast<std::size_t>(status));
}

// Share of the features of the previous image that are still tracked.
std::optional<double> tracked_share(const TrackerStatistics& s) {
  const int before = s.tracked + s.lost + s.motion;
  if (before == 0) return std::nullopt;
  return static_cast<double>(s.tracked) / before;
}

}  // namespace

VioNode::VioNode(Odometry odometry, const VioTopics& topics)
    : WorkerNode({.name = std::holds_alternative<Vio>(odometry) ? VioConfig::kSection : "odometry",
                  .queue = kQueuedPackets}),
      odometry_(std::move(odometry)),
      vio_(std::get_if<Vio>(&odometry_)),
      topics_(topics) {
  follow(topics.packets);
}

void VioNode::conclude() {
  if (vio_ == nullptr) {
    log::info(name()) << images_ << " images, " << without_pose_ << " without a pose, " << jumps_
                      << " jumps";
    return;
  }
  const VioStatistics& s = vio_->statistics();
  log::info(name()) << s.images << " images, " << s.images_without_pose << " without a pose, "
                    << s.starts << " starts in " << s.start_attempts << " attempts, "
                    << s.divergences << " divergences, " << s.contradictions
                    << " of them found by images that contradict the estimate, " << s.gaps
                    << " inertial gaps, " << s.rests << " rests, vision lost " << s.vision_losses
                    << " times, for " << fixed(s.blind_s, 1) << " s; refused " << s.refused_images
                    << " images, " << s.refused_samples << " samples";
}

void VioNode::step(const SensorPacket& packet) {
  VioResult result =
      std::visit([&](auto& odometry) { return odometry.process(packet); }, odometry_);
  ++images_;
  without_pose_ += result.frames.empty() ? 1 : 0;
  jumps_ += result.problem == VioProblem::kJumped ? 1 : 0;
  report(result, packet.frame ? packet.frame->stamp : 0);
  for (const OdometryState& state : result.states) topics_.odometry.publish(state);
  for (const KeyframeOdometry& keyframe : result.keyframes) topics_.keyframes.publish(keyframe);
  for (const LocatedFrame& frame : result.frames) topics_.frames.publish(frame);
  if (vio_ != nullptr) {
    const VioStatistics& statistics = vio_->statistics();
    if (result.problem != VioProblem::kNone || result.start || result.vision ||
        statistics.blind_s > blind_s_)
      topics_.statistics.publish(statistics);
    blind_s_ = statistics.blind_s;
  }
  if (packet.frame == nullptr) return;
  if (result.problem != VioProblem::kNoImage && result.problem != VioProblem::kUnorderedImage)
    topics_.images.publish(TrackedImage{packet.frame, std::move(result.tracked)});
  topics_.processed.publish(ProcessedFrame{packet.frame->stamp, tracked_share(result.tracking)});
}

void VioNode::log_event(const VisionEvent& event, bool has_imu) const {
  const std::string since = fixed(1e-9 * static_cast<double>(event.since), 3) + " s";
  if (event.is_lost)
    log::limited(log::Level::kWarn, name(), "vision lost")
        << "vision lost since " << since << ", " << event.features << " features: the pose is "
        << (has_imu ? "by inertial sensing alone" : "extrapolated");
  else
    log::limited(log::Level::kInfo, name(), "vision back")
        << "vision lost since " << since << " is back after " << fixed(event.lasted_s, 2) << " s, "
        << event.features << " features";
}

void VioNode::report(const VioResult& result, Stamp stamp) const {
  if (result.problem != VioProblem::kNone)
    log::limited(log::Level::kWarn, name(), text(result.problem))
        << "at " << stamp << " ns: " << text(result.problem);
  if (result.vision) log_event(*result.vision, vio_->statistics().has_imu);
  if (!result.start) return;
  if (*result.start == StartStatus::kContinues)
    log::info(name()) << text(*result.start);
  else if (started(*result.start))
    log::info(name()) << text(*result.start) << " with " << result.states.size() << " images";
  else
    log::limited(log::Level::kWarn, name(), text(*result.start))
        << "at " << stamp << " ns: " << text(*result.start);
}

}  // namespace km
