#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Part of their meshes that robots send each other.
enum class TeamMapMode {
  kOff,     ///< Nothing.
  kCoarse,  ///< Their surface in coarse voxels.
  kFull,    ///< Their whole mesh.
};

/// Parameters of the map that the robots of a team share.
struct MapSharingConfig {
  static constexpr const char* kSection = "map";

  TeamMapMode team = TeamMapMode::kOff;
  double coarse_voxel_m = 0.2;
  double max_bytes_per_s = 50000.0;

  void visit_fields(auto& visitor) {
    visitor.field("team", team,
                  {{"off", TeamMapMode::kOff},
                   {"coarse", TeamMapMode::kCoarse},
                   {"full", TeamMapMode::kFull}},
                  "one fused mesh of all robots on every robot (team_mesh.ply): from surfaces in "
                  "coarse voxels, or from whole meshes. All robots of a team need the same mode "
                  "and voxels. A robot without a map only receives");
    visitor.field(
        "coarse_voxel_m", coarse_voxel_m, {0.01, 5.0},
        "[m] side of the voxels of a coarse map; a full one has those of semantic_mapping");
    visitor.field("max_bytes_per_s", max_bytes_per_s, {1000.0, 1e9},
                  "[B/s] average rate of sent chunks; counted once per message, not per receiver");
  }
};

}  // namespace km
