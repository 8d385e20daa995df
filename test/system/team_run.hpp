#pragma once

#include <unistd.h>

#include <nlohmann/json.hpp>

#include "apps/robot/run_summary.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/domain_draw.hpp"
#include "test/support/command.hpp"
#include "test/support/patience.hpp"
#include "test/support/pose_graph_problems.hpp"
#include "test/support/split_graph.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {

/// A DDS domain that no other test uses while this process runs: tests run side by side, and robots
/// of two tests with one id are twins. Waits while other tests have all domains.
inline int random_domain() {
  constexpr unsigned kLastDomain = kLastQuietDomain / 2;  // kimera_multi_team draws those above
  for (const auto end = std::chrono::steady_clock::now() + kPatience;;) try {
      return static_cast<int>(draw_domain(1, kLastDomain));
    } catch (const std::runtime_error&) {
      if (std::chrono::steady_clock::now() > end) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
}

/// Command line of a robot with the configuration of EuRoC.
inline std::string euroc_robot(int robot, const std::string& options,
                               int domain = random_domain()) {
  return KM_BIN_DIR "/kimera_multi_robot --config config/datasets/euroc.yaml --robot " +
         std::to_string(robot) + " --domain " + std::to_string(domain) + ' ' + options;
}

/// Makes a team's folder of keys for `robots`, such as "robot0:0,robot1:1".
inline void make_keys(const fs::path& folder, const std::string& robots) {
  const CommandResult made =
      run_command(KM_BIN_DIR "/kimera_multi_keys make " + folder.string() + " --robots " + robots);
  CAPTURE(made.output);
  REQUIRE(made.exit_code == 0);
}

/// Lines of a file; 0 if there is none.
inline std::size_t line_count(const fs::path& file) {
  std::ifstream in(file);
  return static_cast<std::size_t>(std::count(std::istreambuf_iterator<char>(in), {}, '\n'));
}

/// "robot3".
inline std::string robot_name(int robot) {
  return "robot" + std::to_string(robot);
}

/// A finished run of kimera_multi_team: what it printed, and its --json.
struct TeamRun {  // NOLINT(bugprone-exception-escape): JSON checks itself as it is moved
  CommandResult result;
  Json json;
};

/// Runs a team file on `dataset` as fast as it can, in a random DDS domain. Results go to `folder`.
/// `options` of the program, and of its robots, come in addition.
inline TeamRun run_team(const fs::path& team, const fs::path& dataset,
                        const TemporaryFolder& folder, const std::string& options = {},
                        const std::string& robot_options = {}) {
  const fs::path json = folder.path() / "team.json";
  TeamRun run;
  run.result = run_command(std::string(KM_BIN_DIR "/kimera_multi_team --config ") + team.string() +
                           " --dataset " + dataset.string() + " --rate max --output " +
                           folder.path().string() + " --json " + json.string() + " --domain " +
                           std::to_string(random_domain()) + ' ' + options + " -- " +
                           (robot_options.find("--serve-limit") == std::string::npos
                                ? "--serve-limit 1000 "  // sanitizers are slow
                                : "") +
                           robot_options);
  if (run.result.exit_code == 0) run.json = read_json(json);
  return run;
}

/// Writes what `robot` has recorded, its odometry and every closure that touches it, to
/// part<id>.g2o.
inline void write_part(const SplitGraph& graph, RobotId robot, const fs::path& folder) {
  G2oGraph part;
  for (const RelativePose& e : graph.odometry)
    if (e.from.robot == robot) part.edges.push_back(e);
  for (const RelativePose& e : graph.closures)
    if (e.from.robot == robot || e.to.robot == robot) part.edges.push_back(e);
  write_g2o(folder / ("part" + std::to_string(robot) + ".g2o"), part);
}

/// Writes the parts of all robots of `graph`, whose ids are 0, 1, ..., and a team file that begins
/// with `settings`; the file. The robots are robot0, robot1, ...
inline fs::path write_team(const SplitGraph& graph, const TemporaryFolder& folder,
                           const std::string& settings = {}) {
  std::string team = settings + "robots:\n";
  for (const auto& [robot, keyframes] : graph.keyframes) {
    write_part(graph, robot, folder.path());
    const std::string number = std::to_string(robot);
    team.append("  - {id: ").append(number).append(", name: ").append(robot_name(robot));
    team.append(", graph: part").append(number).append(".g2o}\n");
  }
  return folder.write("team.yaml", team);
}

/// The files of a team's robots as one graph, and the poses they ended with.
struct TeamResult {
  WholeGraph graph;
  std::vector<SE3> poses;
  std::vector<int> robot_of;  ///< Robot of each pose.
};

/// Results of robots 0 to `robots` - 1, from robot0, robot1, ...
inline TeamResult read_team(const fs::path& folder, int robots) {
  std::vector<G2oGraph> parts;
  std::map<KeyframeId, Eigen::Index> index_of;
  TeamResult team;
  for (int i = 0; i < robots; ++i) {
    parts.push_back(read_g2o(folder / robot_name(i) / "pose_graph.g2o"));
    for (const G2oVertex& vertex : parts.back().vertices) {
      index_of[vertex.id] = team.graph.poses++;
      team.poses.push_back(vertex.T_world_kf);
      team.robot_of.push_back(i);
    }
  }
  for (int robot = 0; robot < robots; ++robot)
    for (const RelativePose& edge : parts[static_cast<std::size_t>(robot)].edges)
      if (edge.from.robot == robot)  // an edge between two robots is in the files of both
        team.graph.edges.push_back(block_edge(index_of.at(edge.from), index_of.at(edge.to), edge));
  return team;
}

/// Chordal cost, without 1/2.
inline double cost_of(const WholeGraph& graph, const std::vector<SE3>& poses) {
  double cost = 0.0;
  for (const BlockEdge& edge : graph.edges) {
    const auto block = [&](Eigen::Index i) -> Eigen::MatrixXd {
      return poses[static_cast<std::size_t>(i)].matrix().topRows<3>();
    };
    cost += edge_cost(block(edge.i), block(edge.j), edge.T_i_j, edge.kappa, edge.tau);
  }
  return cost;
}

/// The cost that kimera_multi_pgo reaches for the edges that robots 0 to `robots` - 1 have kept,
/// whose results are in robot0, robot1, ... of `folder`.
inline double solved_in_one_process(const fs::path& folder, int robots) {
  const fs::path parts = folder / "kept";
  fs::create_directory(parts);
  for (int k = 0; k < robots; ++k) {
    const std::string name = robot_name(k);
    fs::copy_file(folder / name / "pose_graph.g2o", parts / (name + ".g2o"));
  }
  const fs::path json = folder / "pgo.json";
  const CommandResult result =
      run_command(std::string(KM_BIN_DIR "/kimera_multi_pgo solve ") + parts.string() +
                  " --method newton --trust-all --json " + json.string());
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  return read_json(json)["rounded_cost"].get<double>();
}

}  // namespace km
