#pragma once

#include <cstddef>
#include <variant>

#include "modules/core/camera/tracked_image.hpp"
#include "modules/core/data/processing_load.hpp"
#include "modules/vio/external_odometry.hpp"
#include "modules/vio/vio.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the odometry node; they must outlive it.
struct VioTopics {
  In<SensorPacket> packets;         ///< In order of time.
  Out<OdometryState> odometry;      ///< One per image, in order of time.
  Out<KeyframeOdometry> keyframes;  ///< Indices without gaps.
  Out<LocatedFrame> frames;         ///< One per image, after its keyframe.
  Out<VioStatistics> statistics;    ///< After events, and for each image while vision is lost.
  Out<TrackedImage> images;         ///< All accepted images.
  Out<ProcessedFrame> processed;    ///< For each packet with an image, at the end of its step.
};

/// Runs an odometry in a thread. A full queue delays the sensors. An external odometry has no
/// statistics.
class VioNode final : public WorkerNode<Topic<SensorPacket>::Message> {
 public:
  using Odometry = std::variant<Vio, ExternalOdometry>;

  VioNode(Odometry odometry, const VioTopics& topics);
  /// See Vio and ExternalOdometry. Call before start().
  void continue_from(const VioCheckpoint& checkpoint) {
    std::visit([&](auto& odometry) { odometry.continue_from(checkpoint); }, odometry_);
  }
  ~VioNode() override { stop(); }

  /// Handles one packet synchronously. The thread calls only this function; tests and replay can
  /// call it too.
  void step(const SensorPacket& packet);

 private:
  void handle(const Topic<SensorPacket>::Message& packet) override { step(*packet); }
  void conclude() override;
  void report(const VioResult& result, Stamp stamp) const;
  void log_event(const VisionEvent& event, bool has_imu) const;

  Odometry odometry_;
  const Vio* const vio_;  // null: an external odometry
  const VioTopics topics_;
  double blind_s_ = 0.0;
  std::size_t images_ = 0, without_pose_ = 0, jumps_ = 0;  // those of an external odometry
};

}  // namespace km
