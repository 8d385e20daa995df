#include <cmath>
#include <fstream>
#include <iterator>
#include <list>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/lab/experiments/world_results.hpp"
#include "apps/team/team_file.hpp"
#include "modules/core/json.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/evaluation/trajectory_report.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Stamps of a robot's keyframes, in order.
std::vector<Stamp> read_stamps(const fs::path& keyframes_csv) {
  std::ifstream in(keyframes_csv, std::ios::binary);
  if (!in) throw std::runtime_error(keyframes_csv.string() + ": cannot be read");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  std::vector<Stamp> stamps;
  for (const TextRow& row : split_rows(text))
    if (row.fields.size() >= 3)
      if (const auto stamp = parse_int64(row.fields[2])) stamps.push_back(*stamp);
  return stamps;
}

// Solved poses are numbered robot by robot in the order of ids, as in TeamGraph.
std::vector<std::vector<StampedPose>> poses_of_robots(const std::vector<StampedPose>& poses,
                                                      const std::vector<RobotPlan>& robots,
                                                      const fs::path& run) {
  std::map<RobotId, std::vector<StampedPose>> by_id;
  for (const RobotPlan& robot : robots)
    for (const Stamp stamp : read_stamps(run / robot.name / "keyframes.csv"))
      by_id[robot.id].push_back({stamp, SE3::Identity()});
  std::size_t count = 0;
  for (auto& [id, own] : by_id)
    for (StampedPose& pose : own)
      if (count++ < poses.size()) pose.T = poses[count - 1].T;
  if (count != poses.size())
    throw std::runtime_error(run.string() + ": its robots have " + std::to_string(count) +
                             " keyframes, the solved graph has " + std::to_string(poses.size()));
  std::vector<std::vector<StampedPose>> in_order;
  for (const RobotPlan& robot : robots) in_order.push_back(std::move(by_id[robot.id]));
  return in_order;
}

// Error of the keyframes of all robots under one alignment, if the truth is known.
void add_error(const WorldConfig& world, const PgoFiles& files, const ExperimentPaths& paths,
               PgoNumbers& numbers) {
  const WorldFiles places = world_files(world, paths);
  const TeamPlan plan = read_team_file(places.team_file, {});
  const auto estimates = poses_of_robots(read_trajectory(files.poses), plan.robots, places.run);
  std::list<std::vector<StampedPose>> truths;  // a list, because the inputs refer to its elements
  std::vector<TrajectoryInput> inputs;
  for (std::size_t r = 0; r < plan.robots.size(); ++r) {
    if (plan.robots[r].truth.empty() || estimates[r].empty()) return;
    truths.push_back(read_trajectory(plan.robots[r].truth));
    inputs.push_back({plan.robots[r].name, truths.back(), estimates[r], std::nullopt});
  }
  const TeamError error = trajectory_error(inputs);
  numbers.error_m = error.joint.position_m.rmse;
  numbers.plot = plot_from_above(inputs, error);
}

// The first entry is the state before the first round.
void add_rounds(const Json& rounds, bool decides, PgoNumbers& numbers) {
  if (rounds.empty()) return;
  const auto at = [&](std::size_t k, const char* key) {
    return number_at(rounds[k], key).value_or(0.0);
  };
  const double finished = (1.0 + PgoNumbers::kFinishedGap) * at(rounds.size() - 1, "/cost");
  std::size_t k = decides ? rounds.size() - 1 : 0;
  while (k + 1 < rounds.size() && at(k, "/cost") > finished) ++k;
  numbers.rounds = static_cast<std::size_t>(at(k, "/round"));
  numbers.bytes = at(k, "/bytes");
  numbers.seconds = at(k, "/critical_path_s");
}

}  // namespace

PgoNumbers read_pgo_numbers(const WorldConfig& world, const PgoMethodConfig& method,
                            const ExperimentPaths& paths) {
  const PgoFiles files = pgo_files(world, method, paths);
  const Json root = read_json(files.json);
  const auto number = [&](const char* key) { return number_at(root, key).value_or(0.0); };
  PgoNumbers numbers;
  numbers.poses = static_cast<std::size_t>(number("/poses"));
  numbers.edges = static_cast<std::size_t>(number("/edges"));
  numbers.cost = number_at(root, "/rounded_cost").value_or(NAN);
  numbers.optimum = number_at(root, "/optimum").value_or(NAN);
  add_rounds(root.value("rounds", Json::array()), root.contains("decided"), numbers);
  add_error(world, files, paths, numbers);
  return numbers;
}

}  // namespace km
