#include "modules/outlier_rejection/pcm.hpp"
#include "modules/outlier_rejection/witnessed_pair.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"
#include "runtime/config_layers.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Every closure in the given files of one team, in the order in which robots that drive at the
// same pace would meet them.
std::vector<Closure> recorded_closures(const std::vector<fs::path>& files) {
  std::map<RobotId, std::vector<OdometryPose>> poses;
  std::vector<RelativePose> edges;
  for (const auto& file : files) {
    const RecordedGraph graph = read_recorded_graph(file);
    poses[graph.robot] = odometry_poses(graph);
    edges.insert(edges.end(), graph.intra_closures.begin(), graph.intra_closures.end());
    for (const RelativePose& edge : graph.inter_closures)
      if (edge.from.robot == graph.robot) edges.push_back(edge);  // the other robot has it too
  }
  const auto known_at = [](const RelativePose& e) { return std::max(e.from.index, e.to.index); };
  std::stable_sort(edges.begin(), edges.end(), [&](const RelativePose& x, const RelativePose& y) {
    return known_at(x) < known_at(y);
  });
  std::vector<Closure> closures;
  for (const RelativePose& e : edges)
    closures.push_back({poses.at(e.from.robot).at(e.from.index),
                        poses.at(e.to.robot).at(e.to.index), e.T_from_to, e.covariance, 0, 0.0});
  return closures;
}

using RobotPair = std::pair<RobotId, RobotId>;

RobotPair pair_of(const Closure& closure) {
  return std::minmax(closure.from.id.robot, closure.to.id.robot);
}

// One Pcm per robot pair, given the closures in turn.
std::map<RobotPair, Pcm> reject_outliers(const std::vector<Closure>& closures,
                                         const PcmConfig& config) {
  std::map<RobotPair, Pcm> pcms;
  for (const Closure& closure : closures) {
    const RobotPair pair = pair_of(closure);
    (void)pcms.try_emplace(pair, pair.first, pair.second, config).first->second.add(closure);
  }
  return pcms;
}

// The files <prefix>0<suffix> ... of a team; empty if they are not there.
std::vector<fs::path> team(const std::string& prefix, int robots, const std::string& suffix) {
  std::vector<fs::path> files;
  for (int robot = 0; robot < robots; ++robot) {
    const auto file = shared_data(prefix + std::to_string(robot) + suffix);
    if (!file) return {};
    files.push_back(*file);
  }
  return files;
}

TEST_CASE("PCM keeps exactly the true half of DOOR-SLAM's simulated closures") {
  const auto [name, robots, true_per_pair] = GENERATE(table<std::string, int, std::size_t>({
      {"spoiled/simulation_not_in_order/example_2robots/", 2, 10},
      {"spoiled/simulation/example_4robots/", 4, 4},
      {"clean/simulation/example_2robots/", 2, 10},
  }));
  CAPTURE(name);
  const auto files =
      team("multi_robot/door_slam/pairwise_consistency_maximization/" + name, robots, ".g2o");
  if (files.empty()) return;
  PcmConfig config;
  config.confidence = 0.99;  // chi-squared 16.8
  const auto pcms = reject_outliers(recorded_closures(files), config);
  CHECK(pcms.size() == static_cast<std::size_t>(robots * (robots - 1) / 2));
  for (const auto& [pair, pcm] : pcms) {
    CHECK(pcm.inliers().size() == true_per_pair);
    CHECK(pcm.size() == (name.starts_with("clean") ? 1 : 2) * true_per_pair);
  }
}

PcmConfig tunnels_config() {
  ConfigLayers layers;
  layers.add_file("config/datasets/tunnels.yaml");
  return layers.load<PcmConfig>();
}

TEST_CASE("Every two robots in tunnels are joined by witnesses") {
  const auto files = team("multi_robot/tunnels_8robots/robot", 8, ".csv");
  if (files.empty()) return;
  const auto config = tunnels_config();
  std::map<RobotPair, WitnessedPair> pairs;
  std::map<RobotPair, std::set<ClosureId>> given;
  for (const Closure& closure : recorded_closures(files)) {
    const RobotPair pair = pair_of(closure);
    (void)pairs.try_emplace(pair, pair.first, pair.second, config).first->second.add(closure);
    given[pair].insert(closure.id());
  }
  for (const auto& [pair, closures] : pairs) {
    CAPTURE(pair.first, pair.second, closures.closures().size());
    CHECK((pair.first == pair.second || closures.is_witnessed()));
    CHECK(closures.closures().size() == given.at(pair).size());
  }
}

}  // namespace
}  // namespace km
