#include "modules/dense_sensing/node/dense_sensing_node.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "runtime/log.hpp"

namespace km {
namespace {

// Length of the input queue. With fewer places, frames without depth would displace frames with
// depth.
constexpr std::size_t kQueuedFrames = 4;
constexpr double kStampJitter_s = 2e-3;

double interval_of(double rate_hz) {
  if (!(rate_hz > 0.0) || !std::isfinite(rate_hz))
    throw std::invalid_argument("DenseSensingNode: a rate of " + std::to_string(rate_hz) + " Hz");
  return 1.0 / rate_hz;
}

}  // namespace

DenseSensingNode::DenseSensingNode(DenseSensor sensor, LabelsFrom labels, double rate_hz,
                                   Overflow overflow, const DenseSensingTopics& topics)
    : WorkerNode({.name = "dense_sensing",
                  .queue = kQueuedFrames,
                  .overflow = overflow,
                  .in_background = true}),
      sensor_(std::move(sensor)),
      wants_labels_(labels != LabelsFrom::kNone),
      interval_s_(interval_of(rate_hz)),
      topics_(topics) {
  topics_.load.subscribe([this](const auto& load) { gives_way_ = load->map; });
  follow(topics.located);
}

void DenseSensingNode::conclude() {
  const DenseSensingProgress& p = progress_;
  log::info(name()) << p.frames << " frames with depth, " << p.without_labels << " without labels, "
                    << p.dropped_under_load << " left out because processors were short";
  if (p.wrong_size + p.wrong_label_size + p.unmapped_pixels > 0)
    log::warn(name()) << "images of the wrong size in " << p.wrong_size << " frames, labels in "
                      << p.wrong_label_size << "; " << p.unmapped_pixels
                      << " pixels of classes that segmentation.label_map lacks";
}

void DenseSensingNode::step(const LocatedFrame& located) {
  const Stamp stamp = located.frame->stamp;
  if (last_ && seconds_between(*last_, stamp) < interval_s_ - kStampJitter_s) return;
  if (gives_way_) {
    ++progress_.dropped_under_load;
    last_ = stamp;
    topics_.progress.publish(progress_);
    return;
  }
  DenseImages images;
  {
    const auto scope = sensing_.measure();
    images = sensor_.sense(*located.frame);
  }
  progress_.without_depth += images.problem == DenseProblem::kNoDepthImage ? 1 : 0;
  progress_.wrong_size += images.problem == DenseProblem::kWrongSize ? 1 : 0;
  progress_.wrong_label_size += images.wrong_label_size ? 1 : 0;
  progress_.unmapped_pixels += images.unmapped_pixels;
  if (images.problem == DenseProblem::kNone) {
    last_ = stamp;
    ++progress_.frames;
    progress_.without_labels += wants_labels_ && images.labels == nullptr ? 1 : 0;
    topics_.frames.publish(
        {.stamp = stamp,
         .depth = images.depth,
         .labels = images.labels,
         .T_odom_cam = located.T_odom_body * located.T_body_rig * sensor_.camera().T_body_cam,
         .keyframe = located.keyframe,
         .color = images.color});
  }
  topics_.progress.publish(progress_);
}

}  // namespace km
