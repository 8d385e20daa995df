#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "apps/result_writer.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/map/occupancy_grid.hpp"
#include "modules/map_2d/map_2d_config.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/team_map/node/team_map_node.hpp"
#include "runtime/latest.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the mesh writer; they must outlive it.
struct MeshFilesTopics {
  In<KeyframeOdometry> keyframes;
  In<Trajectory> trajectory;  ///< Trajectory of this robot.
  In<MapMesh> maps;
  In<OptimizedMesh> optimized;
  In<OccupancyGrid> maps_2d;
};

/// Keeps a robot's meshes and 2D map on disk while it runs, each file whole at any time.
///
/// mesh.ply is the mapper's mesh, as odometry built it. It is moved rigidly so that its first
/// keyframe has its optimised pose in the team's frame. mesh_optimized.ply is the mesh deformed to
/// the optimised keyframes, in the team's frame. map.pgm and map.yaml are the 2D map for map_server
/// of Nav2, in the team's frame. run.map is the mapper's mesh for a process that resumes the run.
class MeshFilesNode final : public WorkerNode<Tick> {
 public:
  /// `results` outlives this and records meshes that could not be written. Such a failure does not
  /// end the node.
  MeshFilesNode(std::filesystem::path folder, ResultWriter& results, const MeshFilesTopics& topics);
  ~MeshFilesNode() override { stop(); }

  /// Writes mesh.ply again, with the last trajectory of the robot. Call after stop().
  void finish(const std::optional<Trajectory>& trajectory);

 private:
  // A tick states that at least one of the newest messages has changed.
  void handle(const Tick& tick) override;

  template <typename T>
  void keep_newest(In<T> topic, Latest<T>& newest) {
    topic.subscribe([this, &newest](const std::shared_ptr<const T>& message) {
      newest.put(message);
      post(Tick());
    });
  }
  void write(const char* file, const auto& writer) { results_.write(folder_ / file, writer); }
  void follow_first_pose(const Trajectory& trajectory);
  void write_map();

  const std::filesystem::path folder_;
  ResultWriter& results_;
  std::optional<SE3> T_odom_first_;   // odometry pose of the first keyframe
  std::optional<SE3> T_world_first_;  // optimised pose of the first keyframe
  std::shared_ptr<const MapMesh> map_;
  Latest<KeyframeOdometry> first_keyframe_;
  Latest<Trajectory> trajectory_;
  Latest<MapMesh> latest_map_;
  Latest<OptimizedMesh> optimized_;
  Latest<OccupancyGrid> map_2d_;
};

/// Writes objects.json to `folder`.
void write_objects(const std::filesystem::path& folder, const ObjectList& objects,
                   const LabelPalette& palette, ResultWriter& results);

/// Writes the fused mesh of the team, of the chunks that were received until now. If 2D maps are
/// enabled, also writes its 2D map.
void write_team_map(const std::filesystem::path& folder, const Map2dConfig& config,
                    const TeamMapNode& node, ResultWriter& results);

}  // namespace km
