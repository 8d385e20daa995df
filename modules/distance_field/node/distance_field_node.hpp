#pragma once

#include <exception>
#include <optional>
#include <string_view>

#include "modules/distance_field/distance_field.hpp"
#include "modules/distance_field/distance_slice.hpp"
#include "modules/semantic_mapping/space_changes.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of the distance field; they must outlive the node.
struct DistanceFieldTopics {
  In<SpaceUpdate> space;
  Out<DistanceSlice> slices;  ///< At the height of the camera, every kSlice_s and at the end.
};

/// Keeps the distance field of the mapper's window on a thread of its own, while the mapper
/// publishes its space. No update is dropped, because each one has only the changes since the last.
class DistanceFieldNode final : public Node {
 public:
  static constexpr double kSlice_s = 1.0;  ///< Interval of slices, by stamps.

  /// Largest distance of the slices, or the 100 voxels that DistanceField can compute.
  static constexpr double kMaxDistance_m = 2.0;

  DistanceFieldNode(double voxel_size_m, const DistanceFieldTopics& topics);
  ~DistanceFieldNode() override { stop(); }

  std::string_view name() const override { return "distance_field"; }
  void start() override { worker_.start(); }
  void stop() noexcept override;
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  double step_limit_s() const override { return 120.0; }
  DurationHistogram timing() const override { return worker_.timing(); }

  /// Handles one update synchronously. The thread calls only this function; tests can call it too.
  void step(const SpaceUpdate& update);

 private:
  void publish_slice();

  const double voxel_size_m_;
  std::optional<DistanceField> field_;
  const Out<DistanceSlice> slices_;
  double camera_z_m_ = 0.0;
  std::optional<Stamp> newest_, published_;
  bool stopped_ = false;
  Worker<Topic<SpaceUpdate>::Message> worker_;  // last member: stops first
};

}  // namespace km
