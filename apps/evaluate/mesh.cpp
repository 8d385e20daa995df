#include "apps/evaluate/mesh.hpp"

#include <algorithm>
#include <deque>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "apps/evaluate/label_palette_file.hpp"
#include "apps/evaluate/named_files.hpp"
#include "apps/evaluate/placement.hpp"
#include "apps/evaluate/stage_progress.hpp"
#include "modules/core/json_writer.hpp"
#include "modules/evaluation/mesh/mesh_checks.hpp"
#include "modules/evaluation/mesh/mesh_report.hpp"
#include "modules/mesh/ply_file.hpp"

namespace km {
namespace {

// Where the robots' trajectories put the meshes.
SE3 placed_by(const MeshCommand& command) {
  const std::size_t estimates = command.trajectories.size();
  const std::size_t truths = command.true_trajectories.size();
  if ((estimates == 0) != (truths == 0) || (truths > 1 && truths != estimates))
    throw std::invalid_argument(
        "give one --trajectory-truth for all --trajectory, or one for each");
  return placement_of(command.trajectories, command.true_trajectories, true);
}

// The palette given, or the one beside the truth, or none.
LabelPalette palette_of(const MeshCommand& command, const LabelledMesh& truth,
                        std::span<const MeshInput> inputs) {
  const std::filesystem::path file =
      command.palette.empty() ? palette_beside(command.truth) : command.palette;
  if (file.empty()) return {};
  const LabelPalette palette = read_label_palette(file);
  check_labels(truth, command.truth.string(), palette, file.string());
  for (const MeshInput& input : inputs)
    check_labels(input.mesh, input.name, palette, file.string());
  return palette;
}

std::string json_of(const MeshReport& report, const LabelPalette& palette) {
  std::ostringstream text;
  JsonWriter json(text);
  write_json(json, report, palette);
  return text.str();
}

constexpr double kLargeMove_m = 0.5;  // beyond, ICP may have found another surface
constexpr const char* kPlacing =
    "the meshes were taken to lie in the frame of the truth; --trajectory and --trajectory-truth "
    "of their robots place them first";

MeshReport compared(const LabelledMesh& truth, std::span<const MeshInput> inputs,
                    const MeshErrorOptions& options, StageProgress& progress,
                    const MeshCommand& command) try {
  return mesh_error(truth, inputs, options,
                    [&](std::string_view stage, double share) { progress(stage, share); });
} catch (const std::invalid_argument& error) {
  const std::string problem = error.what();
  const bool elsewhere = problem.find("in one frame") != problem.npos;
  if (!elsewhere || !command.trajectories.empty()) throw;
  throw std::invalid_argument(problem + "\nnote: " + kPlacing);
}

}  // namespace

void evaluate_meshes(const MeshCommand& command) {
  MeshErrorOptions options = command.options;
  options.T_truth_estimate = placed_by(command);
  StageProgress progress;
  progress("reading", 0.0);
  const LabelledMesh truth = read_ply(command.truth);
  std::deque<LabelledMesh> meshes;  // inputs refer to them
  std::vector<MeshInput> inputs;
  for (const auto& file : command.estimates)
    inputs.push_back({short_name(file), meshes.emplace_back(read_ply(file))});
  const LabelPalette palette = palette_of(command, truth, inputs);

  const MeshReport report = compared(truth, inputs, options, progress, command);
  std::cout << to_table(report, palette);
  if (command.trajectories.empty() && report.moved_m > kLargeMove_m)
    std::cout << "note: " << kPlacing << '\n';
  if (!command.json.empty()) write_file(command.json, json_of(report, palette));
}

}  // namespace km
