#pragma once

#include "modules/core/processing_load.hpp"
#include "modules/core/tracked_image.hpp"
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

/// Runs one Vio in a thread. A full queue delays the sensors.
class VioNode final : public WorkerNode<Topic<SensorPacket>::Message> {
 public:
  /// Throws ConfigError if a config is out of bounds, std::invalid_argument for an unusable rig.
  VioNode(RobotId robot, const SensorRig& rig, const TrackerConfig& tracker,
          const VioConfig& config, const VioTopics& topics);

  /// See Vio. Call before start().
  void continue_from(const VioCheckpoint& checkpoint) { vio_.continue_from(checkpoint); }
  ~VioNode() override { stop(); }

  /// Handles one packet synchronously. The thread calls only this function; tests and replay can
  /// call it too.
  void step(const SensorPacket& packet);

 private:
  void handle(const Topic<SensorPacket>::Message& packet) override { step(*packet); }
  void conclude() override;
  void report(const VioResult& result, Stamp stamp) const;
  void log_event(const VisionEvent& event) const;

  Vio vio_;
  const bool has_imu_;
  const VioTopics topics_;
  double blind_s_ = 0.0;
};

}  // namespace km
