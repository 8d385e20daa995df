#include "apps/lab/pgo/team_graph_file.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <set>
#include <stdexcept>

#include "modules/core/io/input_file.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"

namespace km {
namespace {

std::set<KeyframeId> poses_of(const G2oGraph& graph, const std::string& file) {
  std::set<KeyframeId> poses;
  for (const G2oVertex& vertex : graph.vertices) poses.insert(vertex.id);
  for (const RelativePose& e : graph.edges)
    for (const KeyframeId& id : {e.from, e.to})
      if (graph.vertices.empty())
        poses.insert(id);
      else if (!poses.contains(id))
        throw std::runtime_error(file + ": edge " + to_string(e.from) + " -> " + to_string(e.to) +
                                 " names vertex " + to_string(id) + ", which the file lacks");
  return poses;
}

Precision weight_of(const RelativePose& e, int dimension, const std::string& file) try {
  return precision_of_blocks(e.covariance, dimension);
} catch (const std::invalid_argument&) {
  throw std::runtime_error(file + ": the information matrix of edge " + to_string(e.from) + " -> " +
                           to_string(e.to) + " is not positive definite to the digits of a double");
}

void check_connected(const TeamGraph& graph, const std::string& file) {
  const std::vector<Eigen::Index> part = part_of_poses(graph);
  const auto apart = std::ranges::find_if(part, [](Eigen::Index lowest) { return lowest != 0; });
  if (apart == part.end()) return;
  const auto pose = static_cast<std::size_t>(apart - part.begin());
  throw std::runtime_error(file + ": the graph is not connected: no path of edges from pose " +
                           to_string(graph.ids[0]) + " to pose " + to_string(graph.ids[pose]));
}

void add_vertical(TeamGraph& team, const std::map<KeyframeId, Eigen::Index>& number_of,
                  const G2oVertical& prior, const std::string& file) {
  const auto pose = number_of.find(prior.id);
  if (pose == number_of.end())
    throw std::runtime_error(file + ": the prior on " + to_string(prior.id) +
                             " is on a vertex that the file lacks");
  const auto& [up, sigma] = prior.vertical;
  team.verticals.push_back({pose->second, up, 1.0 / (sigma * sigma)});
}

std::filesystem::path nonempty_folder(const std::filesystem::path& folder) {
  if (!is_folder(folder)) throw std::runtime_error(folder.string() + ": is not a folder");
  return folder;
}

// Files of the pose graphs of a team's run. Without a run: the files in the folder itself.
std::vector<std::filesystem::path> part_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> results, files;
  for (const auto& entry : std::filesystem::directory_iterator(nonempty_folder(folder))) {
    const auto extension = entry.path().extension();
    if (is_there(entry.path() / "pose_graph.g2o"))
      results.push_back(entry.path() / "pose_graph.g2o");
    else if ((extension == ".csv" || extension == ".g2o") && entry.path().stem() != "fullGraph")
      files.push_back(entry.path());
  }
  std::vector<std::filesystem::path>& chosen = results.empty() ? files : results;
  if (chosen.empty())
    throw std::runtime_error(folder.string() +
                             ": no *.csv and no *.g2o in it, and no robot's pose_graph.g2o below");
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

void check_complete(const std::vector<RecordedGraph>& parts, const std::filesystem::path& folder) {
  std::set<RobotId> robots;
  for (const RecordedGraph& part : parts) robots.insert(part.robot);
  for (const RecordedGraph& part : parts)
    for (const RelativePose& e : part.inter_closures)
      for (const RobotId robot : {e.from.robot, e.to.robot})
        if (!robots.contains(robot))
          throw std::runtime_error(folder.string() + ": the graph of robot " +
                                   std::to_string(part.robot) + " has edges to robot " +
                                   std::to_string(robot) +
                                   ", whose file is not there: a folder has those of all robots");
}

std::vector<RecordedGraph> read_parts(const std::vector<std::filesystem::path>& files) {
  std::vector<RecordedGraph> parts;
  for (const auto& file : files) {
    parts.push_back(read_recorded_graph(file));
    if (parts.back().dimension != parts.front().dimension)
      throw std::runtime_error(file.string() + ": 2D and 3D in one folder");
    const auto same = std::find_if(parts.begin(), parts.end() - 1, [&](const RecordedGraph& part) {
      return part.robot == parts.back().robot;
    });
    if (same != parts.end() - 1)
      throw std::runtime_error(file.string() + ": is a second file of robot " +
                               std::to_string(same->robot) +
                               "; a folder is one team's, with one file per robot: of several "
                               "graphs, name one");
  }
  std::sort(parts.begin(), parts.end(),
            [](const RecordedGraph& a, const RecordedGraph& b) { return a.robot < b.robot; });
  return parts;
}

}  // namespace

Precision precision_of_blocks(const Matrix6& covariance, int dimension) {
  if (dimension == 2) return planar_precision_of(covariance);
  if (!covariance.allFinite() || Eigen::LLT<Matrix6>(covariance).info() != Eigen::Success)
    throw std::invalid_argument("precision_of_blocks: covariance is not positive definite");
  return precision_of(covariance);
}

TeamGraph partition_contiguously(const G2oGraph& graph, std::size_t robots,
                                 const std::string& file) {
  const std::set<KeyframeId> poses = poses_of(graph, file);
  if (robots == 0 || robots > poses.size())
    throw std::runtime_error(file + ": has " + std::to_string(poses.size()) +
                             " poses, which cannot be divided among " + std::to_string(robots) +
                             " robots");
  const std::size_t size = poses.size() / robots;
  std::map<KeyframeId, std::size_t> robot_of;
  for (const KeyframeId& id : poses)
    robot_of.emplace(id, std::min(robot_of.size() / size, robots - 1));
  return partition_graph(graph, robot_of, file);
}

TeamGraph partition_graph(const G2oGraph& graph, const std::map<KeyframeId, std::size_t>& robot_of,
                          const std::string& file) {
  TeamGraph team{.dimension = graph.dimension, .indefinite_edges = graph.indefinite_edges};
  std::map<std::size_t, std::vector<KeyframeId>> poses_of_robot;
  const std::set<KeyframeId> poses = poses_of(graph, file);
  for (const auto& [id, robot] : robot_of)
    if (!poses.contains(id))
      throw std::runtime_error(file + ": robot " + std::to_string(robot) + " is given pose " +
                               to_string(id) + ", which the graph lacks");
  for (const KeyframeId& id : poses) {
    const auto robot = robot_of.find(id);
    if (robot == robot_of.end())
      throw std::runtime_error(file + ": pose " + to_string(id) + " is given to no robot");
    poses_of_robot[robot->second].push_back(id);
  }
  if (poses_of_robot.empty()) throw std::runtime_error(file + ": no poses");
  if (graph.edges.empty()) throw std::runtime_error(file + ": no edge, so nothing to optimise");
  if (poses_of_robot.rbegin()->first + 1 != poses_of_robot.size())
    throw std::runtime_error(file + ": robots must be 0 to " +
                             std::to_string(poses_of_robot.size() - 1) + " for " +
                             std::to_string(poses_of_robot.size()) + " robots with poses");
  std::map<KeyframeId, Eigen::Index> number_of;
  team.first.push_back(0);
  for (const auto& [robot, ids] : poses_of_robot) {
    for (const KeyframeId& id : ids)
      number_of.emplace(id, static_cast<Eigen::Index>(number_of.size()));
    team.ids.insert(team.ids.end(), ids.begin(), ids.end());
    team.first.push_back(static_cast<Eigen::Index>(team.ids.size()));
  }
  if (!graph.vertices.empty()) team.vertices.resize(team.ids.size());
  for (const auto& [id, T_file_kf] : graph.vertices)
    team.vertices[static_cast<std::size_t>(number_of.at(id))] = T_file_kf;
  for (const RelativePose& e : graph.edges) {
    const Precision weight = weight_of(e, graph.dimension, file);
    team.edges.push_back(
        {number_of.at(e.from), number_of.at(e.to), e.T_from_to, weight.kappa, weight.tau});
  }
  for (const G2oVertical& prior : graph.verticals) add_vertical(team, number_of, prior, file);
  std::sort(team.verticals.begin(), team.verticals.end(),
            [](const VerticalPrior& a, const VerticalPrior& b) { return a.pose < b.pose; });
  check_connected(team, file);
  return team;
}

TeamGraph read_team_folder(const std::filesystem::path& folder) {
  const std::vector<RecordedGraph> parts = read_parts(part_files(folder));
  check_complete(parts, folder);
  G2oGraph all{.dimension = parts.front().dimension, .vertices = {}, .edges = {}};
  std::map<KeyframeId, std::size_t> robot_of;
  std::set<std::pair<KeyframeId, KeyframeId>> from_start;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    for (std::uint32_t i = 0; i < parts[k].poses(); ++i) {
      all.vertices.push_back({{parts[k].robot, i}, SE3::Identity()});
      robot_of.emplace(KeyframeId{parts[k].robot, i}, k);
    }
    for (const auto& [index, vertical] : parts[k].verticals)
      all.verticals.push_back({{parts[k].robot, index}, vertical});
    all.indefinite_edges += parts[k].indefinite_edges;
    for (const auto* edges : {&parts[k].odometry, &parts[k].intra_closures})
      all.edges.insert(all.edges.end(), edges->begin(), edges->end());
    for (const RelativePose& e : parts[k].inter_closures) {
      if (e.from.robot != parts[k].robot) continue;
      all.edges.push_back(e);
      from_start.emplace(e.from, e.to);
    }
  }
  for (const RecordedGraph& part : parts)
    for (const RelativePose& e : part.inter_closures)
      if (e.to.robot == part.robot && !from_start.contains({e.from, e.to})) all.edges.push_back(e);
  return partition_graph(all, robot_of, folder.string());
}

LabelledTeamGraph labelled_team(const JrlGraph& graph, const std::string& file) {
  G2oGraph all{.dimension = 3, .vertices = {}, .edges = {}};
  std::map<KeyframeId, std::size_t> robot_of;
  TeamTruth truth;
  for (std::size_t k = 0; k < graph.robots.size(); ++k) {
    const RobotId robot = graph.robots[k];
    for (KeyframeIndex i = 0; i < graph.stamps.at(robot).size(); ++i) {
      all.vertices.push_back({{robot, i}, SE3::Identity()});
      robot_of.emplace(KeyframeId{robot, i}, k);
    }
  }
  for (const JrlMeasurement& measured : graph.measurements) {
    all.edges.push_back(measured.edge);
    if (graph.has_labels) truth.is_false.push_back(measured.is_false);
  }
  TeamGraph team = partition_graph(all, robot_of, file);
  if (!graph.truth.empty())
    for (const KeyframeId& id : team.ids) {
      const auto pose = graph.truth.find(id);
      truth.T_world_kf.push_back(pose == graph.truth.end() ? std::nullopt
                                                           : std::optional(pose->second));
    }
  return {std::move(team), std::move(truth), graph.priors, graph.repeated};
}

}  // namespace km
