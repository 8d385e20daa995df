#include "apps/viewer/run_layers.hpp"

#include <yaml-cpp/yaml.h>

#include <optional>
#include <stdexcept>
#include <utility>

#include "apps/result_files.hpp"
#include "apps/viewer/optional_file.hpp"
#include "modules/map_2d/map_server_files.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/objects/object_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

OccupancyGrid read_image(const fs::path& file) try {
  return map_of_image(read_input_file(file));
} catch (const std::invalid_argument& error) {
  throw std::runtime_error(file.string() + ": " + error.what());
}

OccupancyGrid read_map_2d(const fs::path& file, RobotId anchor) {
  OccupancyGrid map = read_image(file.parent_path() / kMap2dImage);
  const YAML::Node yaml = YAML::Load(read_input_file(file));
  map.resolution_m = yaml["resolution"].as<double>();
  map.origin = {yaml["origin"][0].as<double>(), yaml["origin"][1].as<double>()};
  map.z_m = yaml["floor_z"].as<double>(0.0);
  map.anchor = anchor;
  return map;
}

// The content if a robot could send it. Numbers in files may be impossible.
std::optional<ViewContent> checked_content(std::optional<ViewContent> content) {
  if (!content || !decode_view(encode_view(*content)))
    throw std::runtime_error("its values are impossible");
  return content;
}

}  // namespace

std::vector<ViewContent> read_layers(const fs::path& folder, RobotId robot, RobotId anchor,
                                     std::vector<std::string>& notes) {
  std::vector<ViewContent> layers;
  const auto add = [&](const char* name, const auto& read) {
    auto content = read_if_there(folder / name, notes,
                                 [&](const fs::path& file) { return checked_content(read(file)); });
    if (content) layers.push_back(*std::move(content));
  };
  add(kObjectsFile, [](const fs::path& file) { return view_objects(read_object_list(file)); });
  add(kMap2d, [&](const fs::path& file) { return view_raster(read_map_2d(file, anchor)); });
  add(kDistanceSlice, [&](const fs::path& file) { return view_raster(read_mesh(file), robot); });
  return layers;
}

std::vector<MeshChunk> read_team_mesh(const fs::path& folder, RobotId robot, RobotId anchor,
                                      std::vector<std::string>& notes) {
  const auto other = static_cast<RobotId>(robot ^ 1U);
  return read_if_there(folder / kTeamMesh, notes, [&](const fs::path& file) {
    return split_mesh(read_mesh(file), other, anchor, ChunkGrid{}).chunks;
  });
}

}  // namespace km
