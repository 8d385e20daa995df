#pragma once

#include <atomic>
#include <optional>

#include "modules/core/data/odometry.hpp"
#include "modules/core/data/processing_load.hpp"
#include "modules/core/map/dense_frame.hpp"
#include "modules/dense_sensing/dense_sensor.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the dense sensing node; they must outlive it.
struct DenseSensingTopics {
  In<LocatedFrame> located;  ///< In order of time.
  In<ShedLoad> load;         ///< If ShedLoad::map, due frames are dropped, to relieve odometry.
  Out<DenseFrame> frames;
  Out<DenseSensingProgress> progress;  ///< Published with every due frame.
};

/// Makes depth and labels of the frames that are due, as a thread with one DenseSensor.
class DenseSensingNode final : public WorkerNode<Topic<LocatedFrame>::Message> {
 public:
  /// At most `rate_hz` frames a second are published, by their stamps. `overflow`: whether a full
  /// queue delays odometry or drops the oldest frame. Throws std::invalid_argument unless the rate
  /// is positive.
  DenseSensingNode(DenseSensor sensor, LabelsFrom labels, double rate_hz, Overflow overflow,
                   const DenseSensingTopics& topics);
  ~DenseSensingNode() override { stop(); }

  DurationHistogram timing() const override { return sensing_.histogram(); }

  /// Handles one frame synchronously. The thread calls only this function; tests and replay can
  /// call it too.
  void step(const LocatedFrame& located);

 private:
  void handle(const Topic<LocatedFrame>::Message& located) override { step(*located); }
  void conclude() override;

  DenseSensor sensor_;
  const bool wants_labels_;
  const double interval_s_;
  const DenseSensingTopics topics_;
  std::atomic<bool> gives_way_ = false;
  std::optional<Stamp> last_;
  DenseSensingProgress progress_;
  Timing sensing_;  // time of the due frames
};

}  // namespace km
