#include "apps/robot/map_results.hpp"

#include "apps/result_files.hpp"
#include "modules/core/write_file.hpp"
#include "modules/map_2d/map_2d.hpp"
#include "modules/map_2d/map_server_files.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/objects/object_file.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// The 2D map of the team is made of the fused mesh alone, so that all robots have the same.
void write_team_map_2d(const fs::path& folder, const Map2dConfig& config, const TeamMap& team,
                       const LabelPalette& palette, ResultWriter& results) {
  Map2dResult map = make_map_2d(config, {team.mesh, palette});
  map.grid.anchor = team.anchor;
  if (map.status == Map2dStatus::kMade)
    return write_map_2d(folder, kTeamMap2d, kTeamMap2dImage, map.grid, results);
  log::warn("robot") << "no 2D map of the team: its mesh "
                     << (map.status == Map2dStatus::kEmpty ? "has no floor"
                                                           : "needs more than 16 million cells");
}

}  // namespace

void write_objects(const fs::path& folder, const ObjectList& objects, const LabelPalette& palette,
                   ResultWriter& results) {
  results.write(folder / kObjectsFile,
                [&](const auto& file) { write_file(file, objects_json(objects, palette)); });
}

void write_map_2d(const fs::path& folder, const char* name, const char* image,
                  const OccupancyGrid& map, ResultWriter& results) {
  results.write(folder / image, [&](const auto& file) { write_file(file, map_image(map)); });
  results.write(folder / name, [&](const auto& file) { write_file(file, map_yaml(map, image)); });
}

void write_team_map(const fs::path& folder, const Map2dConfig& config, const TeamMapNode& node,
                    ResultWriter& results) {
  log::info("robot") << "fusing the map of the team";
  const TeamMap map = node.fuse();
  results.write(folder / kTeamMesh, [&](const auto& file) { write_mesh(file, map.mesh); });
  if (config.enabled) write_team_map_2d(folder, config, map, node.palette(), results);
  log::info("robot") << "map of the team: " << map.mesh.faces.size()
                     << " faces, in the frame of robot " << map.anchor;
  if (map.other_frames > 0)
    log::warn("robot") << "the map of the team lacks " << map.other_frames
                       << " chunks in frames of robots that have not joined";
  if (map.left_out > 0)
    log::warn("robot") << "the map of the team lacks " << map.left_out << " boxes of "
                       << kMaxMapBoxes + map.left_out << ": its voxels are too small";
}

}  // namespace km
