#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/output_file.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/objects/object_error.hpp"
#include "modules/mesh/mesh_file.hpp"

namespace km {
namespace {

struct ObjectsCommand {
  std::filesystem::path truth;                // objects.json
  std::filesystem::path estimate;             // objects.json
  std::vector<std::filesystem::path> meshes;  // meshes of the robots; empty: all true objects count
  std::vector<std::filesystem::path> trajectories, true_trajectories;
  double min_overlap = 0.25;
  double mapped_m2 = 0.2;
  std::filesystem::path json;  // Not written if empty.
};

std::vector<bool> mapped(const ObjectsCommand& command, const std::vector<NamedObject>& truth,
                         const SE3& T_truth_estimate) {
  if (command.meshes.empty()) return std::vector(truth.size(), true);
  LabelledMesh all;
  for (const auto& file : command.meshes) all.append(read_mesh(file));
  all.transform(T_truth_estimate);
  std::vector<bool> counts;
  for (const double area : mapped_surfaces_m2(all, truth))
    counts.push_back(area >= command.mapped_m2);
  return counts;
}

void run(const ObjectsCommand& command) {
  check_output_folder(command.json);
  const std::vector<NamedObject> truth = read_objects(command.truth);
  std::vector<NamedObject> estimates = read_objects(command.estimate);
  const SE3 T_truth_estimate = placement_of(command.trajectories, command.true_trajectories, false);
  for (NamedObject& object : estimates)
    object.box = upright_box(T_truth_estimate * object.box.pose(), object.box.size_m);
  const ObjectScores scores = score_objects(
      truth, estimates, mapped(command, truth, T_truth_estimate), command.min_overlap);
  std::cout << "matches with an intersection over union of at least "
            << fixed(command.min_overlap, 2) << ":\n"
            << to_table(scores);
  write_output(command.json, [&](std::ostream& out) {
    out << json_text({{"min_overlap", command.min_overlap}, {"classes", to_json(scores)}});
  });
}

constexpr const char* kObjectsDetails =
    R"(Objects of a map against the true ones: precision, recall and overlap of the boxes

An object is right if a true one of its class overlaps with it: the volume that both boxes
share, divided by that of their union (IoU), is at least --min-overlap. "IoU" is the mean of
the matches. A robot sees most objects from one side only, so boxes are too small. With --mesh
only true objects count in "true" and "found" of whose surface, above the ground, at least
--mapped is in the meshes, whatever its label; without it all do.

The simulator writes the true objects to objects.json. Objects of a robot lie in the frame of
its optimised poses; --trajectory and --trajectory-truth place them in the true world.

Example:
  kimera_multi_evaluate objects --truth city/objects.json \
      --estimate results/robot0/objects.json --mesh results/robot*/mesh_optimized.ply \
      --trajectory results/robot0/optimized.tum results/robot1/optimized.tum \
      --trajectory-truth city/robot0/mav0/state_groundtruth_estimate0/data.csv \
                         city/robot1/mav0/state_groundtruth_estimate0/data.csv)";

void define(CLI::App& app, ObjectsCommand& command) {
  app.add_option("--truth", command.truth, "The true objects (objects.json)")->required();
  app.add_option("--estimate", command.estimate, "The objects of a robot (objects.json)")
      ->required();
  app.add_option("--mesh", command.meshes, "Meshes of all robots in the frame of the objects");
  app.add_option("--mapped", command.mapped_m2,
                 "Mapped surface from which a true object counts [m^2]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--min-overlap", command.min_overlap,
                 "Smallest intersection over union of a match")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--trajectory", command.trajectories,
                 "Estimated poses of the robots in the frame of the objects, TUM or EuRoC CSV");
  app.add_option("--trajectory-truth", command.true_trajectories,
                 "Their true poses: one file for each");
  app.add_option("--json", command.json, "Also write the numbers to this file, as JSON");
}

}  // namespace

void add_objects(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("objects", kObjectsDetails);
  const auto command = std::make_shared<ObjectsCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
