#include "modules/evaluation/exports/glb_file.hpp"

#include <filesystem>
#include <iostream>
#include <memory>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/output_file.hpp"
#include "modules/mesh/mesh_file.hpp"

namespace km {
namespace {

struct GlbCommand {
  std::vector<std::filesystem::path> meshes;
  std::filesystem::path palette;  // default: the palette beside the first mesh
  std::filesystem::path output;
};

void run(const GlbCommand& command) {
  check_output_folder(command.output);
  LabelledMesh all;
  for (const auto& file : command.meshes) all.append(read_mesh(file));
  const LabelPalette palette = read_palette(command.palette, command.meshes.front(), {});
  write_glb(command.output, all, palette);
  std::cout << command.output.string() << ": " << all.faces.size() << " faces\n";
}

constexpr const char* kGlbDetails =
    R"(Meshes as one binary glTF file (.glb), for viewers, game engines and browsers

Each class is a material with its name and its colour. Meshes must be in one frame, like those
of a team.

Example:
  kimera_multi_evaluate glb --mesh results/robot*/mesh_optimized.ply --output city.glb)";

}  // namespace

void add_glb(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("glb", kGlbDetails);
  const auto command = std::make_shared<GlbCommand>();
  app.add_option("--mesh", command->meshes, "Meshes (PLY) in one frame")->required();
  app.add_option("--palette", command->palette,
                 "Names of the labels (CSV); default: label_palette.csv beside the first mesh");
  app.add_option("--output", command->output, "File to write")->required();
  app.callback([command] { run(*command); });
}

}  // namespace km
