#include "modules/evaluation/consistency.hpp"

#include <deque>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/output_file.hpp"
#include "modules/core/io/json.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/evaluation/report.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/recorded_graph/g2o_io.hpp"

namespace km {
namespace {

constexpr ReportColumn kColumns[] = {{"NEES / degrees of freedom", "/name"},
                                     {"poses", "/poses"},
                                     {"pose", "/pose", 2},
                                     {"median", "/median", 2},
                                     {"rotation", "/rotation", 2},
                                     {"translation", "/translation", 2},
                                     percent_column("within 95 %", "/share_within_95")};

Json to_json(const std::vector<Consistency>& robots) {
  Json json = Json::array();
  for (const Consistency& c : robots)
    json.push_back({{"name", c.name},
                    {"poses", c.poses},
                    {"pose", c.pose},
                    {"median", c.median},
                    {"rotation", c.rotation},
                    {"translation", c.translation},
                    {"share_within_95", c.share_within_95}});
  return json;
}

// Edges of the graphs of all robots: each closure once, although both of its robots write it.
struct Edges {
  std::vector<RelativePose> steps;
  std::map<ClosureId, RelativePose> closures;
  std::map<KeyframeId, SE3> truth;

  void add(const std::filesystem::path& folder, std::span<const StampedPose> true_poses) {
    for (const KeyframeRecord& keyframe : read_keyframes(folder / "keyframes.csv"))
      if (const auto T = pose_at(true_poses, keyframe.stamp)) truth[keyframe.id] = *T;
    for (const RelativePose& e : read_g2o(folder / "pose_graph.g2o").edges) {
      const bool step = e.from.robot == e.to.robot && e.to.index == e.from.index + 1;
      if (step)
        steps.push_back(e);
      else
        closures.try_emplace(closure_id(e.from, e.to), e);
    }
  }
};

struct ConsistencyCommand {
  std::vector<std::filesystem::path> truths, results;
  bool upright = false;
  std::filesystem::path json;

  void define(CLI::App& app) {
    app.add_option("--truth", truths, "True poses: one file for all robots or one for each")
        ->required();
    app.add_option("--results", results, "Folders of the results, one per robot")->required();
    app.add_flag("--upright", upright,
                 "Both frames have z up: runs with inertial sensing, and a truth with z up");
    app.add_option("--json", json, "Also write the numbers to this file");
  }

  void run() const {
    check_output_folder(json);
    const auto true_poses = read_truths(truths, results.size(), "--results");
    std::deque<UncertainTrajectory> estimates;  // inputs refer to them
    std::vector<ConsistencyInput> inputs;
    Edges edges;
    for (std::size_t i = 0; i < results.size(); ++i) {
      const auto& truth = of_each(true_poses, i);
      const UncertainTrajectory& estimate =
          estimates.emplace_back(read_uncertain_trajectory(results[i] / "optimized_keyframes.tum"));
      inputs.push_back(
          {"poses of " + short_name(results[i]), truth, estimate.poses, estimate.covariances});
      edges.add(results[i], truth);
    }
    std::vector<Consistency> rows = consistency(inputs, upright);
    rows.back().name = "all poses";
    rows.push_back(consistency_of_edges("steps of odometry", edges.steps, edges.truth));
    std::vector<RelativePose> closures;
    for (const auto& [id, closure] : edges.closures) closures.push_back(closure);
    rows.push_back(consistency_of_edges("closures", closures, edges.truth));
    const Json numbers = to_json(rows);
    std::cout << report_table(numbers, kColumns);
    write_json_output(json, numbers);
  }
};

constexpr const char* kDetails =
    R"(Whether covariances are as large as the errors against the truth

--results are the folders of the robots of one team. Three kinds of covariances are compared:
  poses              of optimized_keyframes.tum, relative to the first keyframe of the team,
                     at which the frame of the team is placed in the truth
  steps of odometry  from keyframe to keyframe, in pose_graph.g2o
  closures           that the team has kept, in pose_graph.g2o
Printed is the normalised estimation error squared (NEES) divided by its degrees of freedom.
It is 1 if covariances are right, 4 if standard deviations are half as large as the errors.
Poses of one run are correlated, so the mean of one run differs from 1 by chance. The median is
relative to that of its distribution.

Example:
  kimera_multi_evaluate consistency --upright --truth robot0/truth.csv --truth robot1/truth.csv \
      --results results/robot0 results/robot1)";

}  // namespace

void add_consistency(CLI::App& app) {
  add_command<ConsistencyCommand>(app, "consistency", kDetails);
}

}  // namespace km
