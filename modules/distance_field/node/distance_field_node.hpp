#pragma once

#include <optional>

#include "modules/distance_field/distance_field.hpp"
#include "modules/distance_field/distance_slice.hpp"
#include "modules/semantic_mapping/space_changes.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the distance field; they must outlive the node.
struct DistanceFieldTopics {
  In<SpaceUpdate> space;
  Out<DistanceSlice> slices;  ///< At the height of the camera, every kSlice_s and at the end.
};

/// Keeps the distance field of the mapper's window on a thread of its own, while the mapper
/// publishes its space. No update is dropped, because each one has only the changes since the last.
class DistanceFieldNode final : public WorkerNode<Topic<SpaceUpdate>::Message> {
 public:
  static constexpr double kSlice_s = 1.0;  ///< Interval of slices, by stamps.

  /// Largest distance of the slices: both hold. The time of a slice is proportional to the voxels.
  static constexpr double kMaxDistance_m = 2.0, kMaxDistance_voxels = 100.0;

  explicit DistanceFieldNode(const DistanceFieldTopics& topics);
  ~DistanceFieldNode() override { stop(); }

  /// Handles one update synchronously. The thread calls only this function; tests can call it too.
  void step(const SpaceUpdate& update);

 private:
  void handle(const Topic<SpaceUpdate>::Message& update) override { step(*update); }
  void conclude() override {
    if (newest_) publish_slice();
  }
  void publish_slice();

  std::optional<DistanceField> field_;
  const Out<DistanceSlice> slices_;
  double camera_z_m_ = 0.0;
  std::optional<Stamp> newest_, published_;
};

}  // namespace km
