#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "modules/core/map/dense_frame.hpp"
#include "modules/mesh/resumed_map.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "runtime/latest.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the mapping node; they must outlive it.
struct SemanticMappingTopics {
  In<DenseFrame> frames;             ///< In order of time.
  In<SupersededSurface> superseded;  ///< Surface of the newest map that is mapped twice. Only the
                                     ///< newest message counts.
  Out<MapMesh> maps;                 ///< The whole map.
  Out<MappingProgress> progress;     ///< With every frame.
};

/// Builds a robot's map as a thread with one SemanticMapper. The mesh is published every few
/// seconds and at the end.
class SemanticMappingNode final : public WorkerNode<Topic<DenseFrame>::Message> {
 public:
  /// `camera` takes the frames. A mesh is published every `mesh_interval_s`, by stamps. `overflow`:
  /// whether a full queue delays the frames or drops the oldest. Throws under the conditions of
  /// SemanticMapper.
  SemanticMappingNode(const SemanticMappingConfig& config, const Camera& camera,
                      const LabelPalette& palette, double mesh_interval_s, Overflow overflow,
                      const SemanticMappingTopics& topics);
  ~SemanticMappingNode() override { stop(); }

  /// The mesh is appended to the map of an earlier process. Call before start().
  void continue_from(ResumedMap before) { before_.emplace(std::move(before)); }

  /// Drops superseded surface and then handles one frame, synchronously. The thread calls only this
  /// function; tests and replay can call it too.
  void step(const DenseFrame& frame);

 private:
  void handle(const Topic<DenseFrame>::Message& frame) override { step(*frame); }
  void conclude() override;
  void make_mapper();
  void map_first();
  void map(const DenseFrame& frame);
  void count(const DenseFrame& frame, const IntegrationReport& report);
  void drop_superseded();
  void publish_mesh();

  SemanticMappingConfig config_;
  Camera camera_;
  std::optional<SemanticMapper> mapper_;
  std::vector<DenseFrame> first_;  // frames before the side of voxels is chosen
  LabelPalette palette_;
  const double mesh_interval_s_;
  const SemanticMappingTopics topics_;
  std::optional<ResumedMap> before_;
  MappingProgress progress_;
  std::optional<KeyframeIndex> meshed_;  // keyframe of the last update of the mesh
  std::optional<Stamp> published_;       // stamp at the last mesh, or of the first frame
  // Superseded surface results from the node's own maps. It does not wait for room in the node's
  // queue, because this would be a deadlock.
  Latest<SupersededSurface> superseded_;
};

}  // namespace km
