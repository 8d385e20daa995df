#pragma once

#include <filesystem>
#include <optional>

#include "apps/robot/assemblies/robot_core.hpp"
#include "apps/robot/mesh_files_node.hpp"
#include "modules/constellations/node/constellations_node.hpp"
#include "modules/map_2d/node/map_2d_node.hpp"
#include "modules/mesh_deformation/node/mesh_deformation_node.hpp"
#include "modules/team_map/node/team_map_node.hpp"

namespace km {

/// From depth images to the maps: mesh, objects and 2D map of this robot, and those of the team.
class Mapping {
 public:
  /// `plan`: nullopt without a map of its own. `rig`: of the sensors, if there are any. `before`:
  /// the map to continue. The maps are written to `options.output` by `results`, which outlives
  /// this.
  Mapping(RobotCore& core, const RobotOptions& options, const RobotConfig& config,
          const std::optional<MappingPlan>& plan, const std::optional<StereoRig>& rig,
          std::optional<ResumedMap> before, ResultWriter& results);

  /// Null without a map.
  [[nodiscard]] MeshFilesNode* files() const { return files_; }
  /// Null without labels.
  [[nodiscard]] ObjectsNode* objects() const { return objects_; }
  /// Null unless the robots share their map.
  [[nodiscard]] const TeamMapNode* team_map() const { return team_map_; }
  /// True unless the robot has yet to send a part of its mesh, or to compare received objects with
  /// its own. Thread-safe.
  [[nodiscard]] bool is_shared() const {
    const bool is_current = mesh_deformation_ == nullptr || mesh_deformation_->is_current();
    if (constellations_ != nullptr && !(is_current && constellations_->is_done())) return false;
    return chunks_ == nullptr || (is_current && chunks_->is_done());
  }
  /// Corrects the mesh with the present trajectory, for the last time.
  void finish() {
    if (mesh_deformation_ != nullptr) mesh_deformation_->finish();
  }

 private:
  void add_mapper(const RobotConfig& config, bool waits, const StereoRig& rig,
                  const MappingPlan& plan, std::optional<ResumedMap> before);
  void add_corrected(const RobotConfig& config, const std::filesystem::path& folder,
                     const LabelPalette& palette, ResultWriter& results);
  void add_objects(const ObjectsConfig& config, const std::filesystem::path& folder,
                   const LabelPalette& palette, ResultWriter& results);
  void share(const MapSharingConfig& config, const LabelPalette& palette);

  RobotCore& core_;
  std::optional<RayThinner> ray_thinner_;  // until the 2D map takes it
  MeshDeformationNode* mesh_deformation_ = nullptr;
  MeshFilesNode* files_ = nullptr;
  ObjectsNode* objects_ = nullptr;
  ConstellationsNode* constellations_ = nullptr;
  TeamMapNode* team_map_ = nullptr;
  MeshChunksNode* chunks_ = nullptr;
};

}  // namespace km
