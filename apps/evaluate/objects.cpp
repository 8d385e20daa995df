#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/output_file.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/evaluation/objects/object_error.hpp"

namespace km {
namespace {

constexpr double kMinOverlap = 0.25;  // smallest intersection over union of a match
constexpr double kMapped_m2 = 0.2;    // mapped surface from which a true object counts

struct ObjectsCommand {
  std::filesystem::path truth, estimate, json;
  std::vector<std::filesystem::path> meshes, trajectories, true_trajectories;

  void define(CLI::App& app) {
    app.add_option("--truth", truth, "The true objects (objects.json)")->required();
    app.add_option("--estimate", estimate, "The objects of a robot (objects.json)")->required();
    app.add_option("--mesh", meshes, "Meshes of all robots in the frame of the objects");
    app.add_option("--trajectory", trajectories,
                   "Estimated poses of the robots in the frame of the objects, TUM or EuRoC CSV");
    app.add_option("--trajectory-truth", true_trajectories, "Their true poses: one file for each");
    app.add_option("--json", json, "Also write the numbers to this file, as JSON");
  }

  // The true objects that count.
  [[nodiscard]] std::vector<bool> mapped(const std::vector<NamedObject>& objects,
                                         const SE3& T_truth_estimate) const {
    if (meshes.empty()) return std::vector(objects.size(), true);
    LabelledMesh all = read_meshes(meshes);
    all.transform(T_truth_estimate);
    std::vector<bool> counts;
    for (const double area : mapped_surfaces_m2(all, objects)) counts.push_back(area >= kMapped_m2);
    return counts;
  }

  void run() const {
    check_output_folder(json);
    const std::vector<NamedObject> true_objects = read_objects(truth);
    std::vector<NamedObject> estimates = read_objects(estimate);
    const SE3 T_truth_estimate = placement_of(trajectories, true_trajectories, false);
    for (NamedObject& object : estimates)
      object.box = upright_box(T_truth_estimate * object.box.pose(), object.box.size_m);
    const ObjectScores scores =
        score_objects(true_objects, estimates, mapped(true_objects, T_truth_estimate), kMinOverlap);
    std::cout << "matches with an intersection over union of at least " << fixed(kMinOverlap, 2)
              << ":\n"
              << to_table(scores);
    write_json_output(json, {{"min_overlap", kMinOverlap}, {"classes", to_json(scores)}});
  }
};

constexpr const char* kObjectsDetails =
    R"(Objects of a map against the true ones: precision, recall and overlap of the boxes

An object is right if a true one of its class overlaps with it: the volume that both boxes
share, divided by that of their union (IoU), is at least 0.25. "IoU" is the mean of
the matches. A robot sees most objects from one side only, so boxes are too small. With --mesh
only true objects count in "true" and "found" of whose surface, above the ground, at least
0.2 m^2 is in the meshes, whatever its label; without it all do.

The simulator writes the true objects to objects.json. Objects of a robot lie in the frame of
its optimised poses; --trajectory and --trajectory-truth place them in the true world.

Example:
  kimera_multi_evaluate objects --truth city/objects.json \
      --estimate results/robot0/objects.json --mesh results/robot*/mesh_optimized.ply \
      --trajectory results/robot0/optimized.tum results/robot1/optimized.tum \
      --trajectory-truth city/robot0/mav0/state_groundtruth_estimate0/data.csv \
                         city/robot1/mav0/state_groundtruth_estimate0/data.csv)";

}  // namespace

void add_objects(CLI::App& app) {
  add_command<ObjectsCommand>(app, "objects", kObjectsDetails);
}

}  // namespace km
