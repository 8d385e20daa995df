#include "apps/evaluate/glb_file.hpp"

#include <filesystem>
#include <iostream>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/output_file.hpp"

namespace km {
namespace {

struct GlbCommand {
  std::vector<std::filesystem::path> meshes;
  std::filesystem::path palette, output;

  void define(CLI::App& app) {
    app.add_option("--mesh", meshes, "Meshes (PLY) in one frame")->required();
    app.add_option("--palette", palette,
                   "Names of the labels (CSV); default: label_palette.csv beside the first mesh");
    app.add_option("--output", output, "File to write")->required();
  }

  void run() const {
    check_output_folder(output);
    const LabelledMesh all = read_meshes(meshes);
    write_glb(output, all, read_palette(palette, meshes.front(), {}));
    std::cout << output.string() << ": " << all.faces.size() << " faces\n";
  }
};

constexpr const char* kGlbDetails =
    R"(Meshes as one binary glTF file (.glb), for viewers, game engines and browsers

Each class is a material with its name and its colour. Meshes must be in one frame, like those
of a team.

Example:
  kimera_multi_evaluate glb --mesh results/robot*/mesh_optimized.ply --output city.glb)";

}  // namespace

void add_glb(CLI::App& app) {
  add_command<GlbCommand>(app, "glb", kGlbDetails);
}

}  // namespace km
