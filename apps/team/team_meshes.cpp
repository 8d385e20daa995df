#include "apps/team/team_meshes.hpp"

#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <span>
#include <utility>

#include "apps/team/text_table.hpp"
#include "modules/mesh/ply_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// By robot, in the order of the plan; those that left none are not in it.
using Meshes = std::vector<std::pair<std::string, LabelledMesh>>;

Meshes read_meshes(const TeamPlan& plan, const char* file, std::vector<std::string>& notes) {
  Meshes meshes;
  for (const RobotPlan& robot : plan.robots) {
    const fs::path path = plan.output / robot.name / file;
    if (!fs::exists(path)) continue;
    try {
      meshes.emplace_back(robot.name, read_ply(path));
      if (!meshes.back().second.faces.empty()) continue;
      notes.push_back(path.string() + ": the mesh is empty");
      meshes.pop_back();
    } catch (const MeshFileError& error) {
      notes.emplace_back(error.what());
    }
  }
  return meshes;
}

// Of a city the table would else take longer than the run; kimera_multi_evaluate mesh takes more.
constexpr std::size_t kMostSamples = 2'000'000;

std::optional<MeshReport> compare(const LabelledMesh& truth, const Meshes& meshes,
                                  const SE3& T_truth_team, std::vector<std::string>& notes) try {
  if (meshes.empty()) return std::nullopt;
  std::vector<MeshInput> inputs;
  for (const auto& [name, mesh] : meshes) inputs.push_back({name, mesh});
  MeshErrorOptions options;
  options.T_truth_estimate = T_truth_team;
  options.max_samples = kMostSamples;
  return mesh_error(truth, inputs, options);
} catch (const std::exception& error) {
  notes.push_back(std::string("meshes are not compared: ") + error.what());
  return std::nullopt;
}

void note_uncorrected(const Meshes& before, const Meshes& after, std::vector<std::string>& notes) {
  std::map<std::string, int> corrected;
  for (const auto& [name, mesh] : after) ++corrected[name];
  for (const auto& [name, mesh] : before)
    if (!corrected.contains(name)) notes.push_back(name + " left a mesh, but none corrected");
}

const MeshError* find(const std::optional<MeshReport>& report, const std::string& name) {
  if (!report) return nullptr;
  for (const MeshError& error : report->robots)
    if (error.name == name) return &error;
  return nullptr;
}

std::string right_labels(const std::optional<MeshReport>& report, const MeshError* error) {
  if (error == nullptr || !report->has_labels) return "-";
  return fixed(100.0 * error->seen.labels.total().accuracy(), 1) + '%';
}

std::vector<std::string> row(const std::string& name, const TeamMeshes& meshes,
                             const MeshError* before, const MeshError* after) {
  const auto number = [](const MeshError* error, auto value) {
    return error != nullptr ? fixed(value(*error), 4) : std::string("-");
  };
  const auto mean = [](const MeshError& error) { return error.truth.point.mean_m; };
  const auto in_front = [](const MeshError& error) { return error.seen.point.mean_m; };
  const MeshError* const any = after != nullptr ? after : before;
  return {name,
          any != nullptr ? std::to_string(any->faces) : "-",
          any != nullptr ? fixed(100.0 * any->coverage, 1) + '%' : "-",
          number(before, mean),
          number(before, in_front),
          right_labels(meshes.odometry, before),
          number(after, mean),
          number(after, in_front),
          right_labels(meshes.optimized, after)};
}

}  // namespace

TeamMeshes collect_meshes(const TeamPlan& plan, const SE3& T_truth_team,
                          std::vector<std::string>& notes) {
  TeamMeshes result;
  const Meshes before = read_meshes(plan, "mesh.ply", notes);
  const Meshes after = read_meshes(plan, "mesh_optimized.ply", notes);
  note_uncorrected(before, after, notes);
  for (const auto& [name, mesh] : after) result.merged.append(mesh);
  result.merged.transform(T_truth_team);
  if (plan.truth_mesh.empty() || before.empty()) return result;
  try {
    std::cerr << "comparing the meshes with " << plan.truth_mesh.string() << " ...\n";
    const LabelledMesh truth = read_ply(plan.truth_mesh);
    result.odometry = compare(truth, before, T_truth_team, notes);
    result.optimized = compare(truth, after, T_truth_team, notes);
  } catch (const MeshFileError& error) {
    notes.emplace_back(error.what());
  }
  return result;
}

std::string to_table(const TeamMeshes& meshes) {
  const auto& any = meshes.optimized ? meshes.optimized : meshes.odometry;
  if (!any) return "";
  std::vector<std::vector<std::string>> rows = {{"mesh", "faces", "covered", "odometry: error [m]",
                                                 "in front", "labels", "optimized: error [m]",
                                                 "in front", "labels"}};
  for (const MeshError& error : (meshes.odometry ? meshes.odometry : any)->robots)
    rows.push_back(row(error.name, meshes, find(meshes.odometry, error.name),
                       find(meshes.optimized, error.name)));
  rows.push_back(row("team, one frame", meshes,
                     meshes.odometry ? &meshes.odometry->merged : nullptr,
                     meshes.optimized ? &meshes.optimized->merged : nullptr));
  const MeshErrorOptions options;
  return align_columns(rows) +
         "Error: mean distance to the mesh from the points of the true one, " +
         fixed(any->samples_per_m2, 0) + " a square metre, within " + fixed(options.crop_m, 1) +
         " m of it\n(covered), after ICP of all together. In front: without those that no robot "
         "can have seen. Labels: share of\nthese that is right.\n";
}

}  // namespace km
