#include <deque>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/mesh/surface_copies.hpp"
#include "modules/mesh/mesh_file.hpp"

namespace km {
namespace {

struct CopiesCommand {
  std::vector<std::filesystem::path> meshes;  // PLY, one file per robot
  SurfaceCopiesOptions options;
};

void run(const CopiesCommand& command) {
  if (command.meshes.size() < 2)
    throw std::invalid_argument("give the meshes of two robots or more");
  std::deque<LabelledMesh> meshes;
  for (const auto& file : command.meshes) meshes.push_back(read_mesh(file));
  std::vector<std::vector<std::string>> rows = {
      {"meshes", "shared", "median [mm]", "95 % [mm]", "median aligned [mm]"}};
  for (std::size_t a = 0; a < meshes.size(); ++a)
    for (std::size_t b = a + 1; b < meshes.size(); ++b) {
      const auto copies = compare_copies(meshes[a], meshes[b], command.options);
      if (!copies) throw std::invalid_argument("a mesh has no faces");
      rows.push_back({short_name(command.meshes[a]) + " " + short_name(command.meshes[b]),
                      fixed(100.0 * copies->shared, 1) + " %", fixed(1e3 * copies->median_m, 1),
                      fixed(1e3 * copies->p95_m, 1), fixed(1e3 * copies->median_aligned_m, 1)});
    }
  std::cout << align_columns(rows);
}

constexpr const char* kCopiesDetails =
    R"(Distances between the copies of a surface that two robots have mapped (double walls)

The meshes lie in one frame. Each is sampled evenly. A sample has a copy if the other mesh has a
face within --reach whose normal is within 60 degrees, and does not end there. The distance is
along the normal of that face. "median aligned" is the median after one rigid motion by ICP:
the part that is not an error of the robots' relative pose.

Example:
  kimera_multi_evaluate copies --mesh results/robot*/mesh_optimized.ply)";

}  // namespace

void add_copies(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("copies", kCopiesDetails);
  const auto command = std::make_shared<CopiesCommand>();
  app.add_option("--mesh", command->meshes, "Meshes (PLY) in one frame, one file per robot")
      ->required();
  app.add_option("--reach", command->options.reach_m, "Largest distance of two copies [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.callback([command] { run(*command); });
}

}  // namespace km
