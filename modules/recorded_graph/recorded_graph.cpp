#include "modules/recorded_graph/recorded_graph.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <set>
#include <stdexcept>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/recorded_graph/jrl_io.hpp"
#include "modules/recorded_graph/text_fields.hpp"

namespace km {
namespace {

constexpr std::string_view kColumns =
    "robot_src,pose_src,robot_dst,pose_dst,qx,qy,qz,qw,tx,ty,tz,kappa,tau";

KeyframeId read_keyframe(TextFields& fields) {
  const auto robot = fields.integer("robot", std::numeric_limits<RobotId>::max());
  const auto index = fields.integer("pose", std::numeric_limits<std::uint32_t>::max());
  return {static_cast<RobotId>(robot), static_cast<std::uint32_t>(index)};
}

RelativePose read_row(TextFields& fields) {
  RelativePose row;
  row.from = read_keyframe(fields);
  row.to = read_keyframe(fields);
  if (row.from == row.to) fields.fail("measurement from " + to_string(row.from) + " to itself");
  const Eigen::Matrix3d R = fields.rotation();
  Eigen::Vector3d t;
  for (double& c : t) c = fields.number("translation", kStep_m);
  row.T_from_to = make_pose(R, t);
  const Precision precision{fields.number("kappa"), fields.number("tau")};
  if (!(precision.kappa > 0.0 && precision.tau > 0.0))
    fields.fail("kappa and tau must be positive");
  if (!kVariance.contains(1.5 / precision.kappa) || !kVariance.contains(3.0 / precision.tau))
    fields.fail("kappa " + shortest_text(precision.kappa) + " and tau " +
                shortest_text(precision.tau) + " mean variances outside " + kVariance.text());
  row.covariance = covariance_of(precision);
  // Columns after tau, such as weight, are not used. They are checked, because a row with a damaged
  // column is not trustworthy.
  while (!fields.at_end()) fields.number("column after tau");
  return row;
}

// The only robot with edges between its own keyframes. Throws if there is none or several.
RobotId owner(const std::vector<RelativePose>& edges, const std::string& file) {
  std::set<RobotId> owners;
  for (const RelativePose& edge : edges)
    if (edge.from.robot == edge.to.robot) owners.insert(edge.from.robot);
  if (owners.size() == 1) return *owners.begin();
  std::string list;
  for (const RobotId robot : owners) list += ' ' + std::to_string(robot);
  throw std::runtime_error(file + ": must hold the odometry of one robot, has that of" +
                           (owners.empty() ? " none" : list));
}

RelativePose unknown_step(const KeyframeId& from) {
  RelativePose step{from, {from.robot, from.index + 1}, SE3::Identity(), Matrix6::Zero()};
  step.covariance.diagonal().head<3>().setConstant(kUnknownTurn_rad * kUnknownTurn_rad);
  step.covariance.diagonal().tail<3>().setConstant(kUnknownStep_m * kUnknownStep_m);
  return step;
}

// Throws if a keyframe up to `last` has no edge.
void check_edges(const std::vector<RelativePose>& edges, RobotId robot, std::size_t last,
                 const std::string& file) {
  std::vector<bool> has_edge(last + 1, false);
  for (const RelativePose& edge : edges)
    for (const KeyframeId& id : {edge.from, edge.to})
      if (id.robot == robot) has_edge[id.index] = true;
  const auto gap = std::ranges::find(has_edge, false);
  if (gap != has_edge.end())
    throw std::runtime_error(
        file + ": no edge of keyframe " +
        to_string({robot, static_cast<std::uint32_t>(gap - has_edge.begin())}));
}

// Number of steps of odometry if every index in the file is on the chain. Throws if there are fewer
// edges than steps, so that a wrong index cannot require more memory than the file has rows.
std::size_t chain_length(const std::vector<RelativePose>& edges, RobotId robot,
                         const std::string& file) {
  std::size_t last = 0;
  for (const RelativePose& edge : edges)
    for (const KeyframeId& id : {edge.from, edge.to})
      if (id.robot == robot) last = std::max<std::size_t>(last, id.index);
  if (last <= edges.size()) return last;
  throw std::runtime_error(file + ": no odometry up to " +
                           to_string({robot, static_cast<std::uint32_t>(last)}));
}

// The optimiser of a robot accepts narrower limits than a file.
void check_variances(const std::vector<RelativePose>& edges, const std::string& file) {
  for (const RelativePose& edge : edges)
    for (const double trace : {edge.covariance.topLeftCorner<3, 3>().trace(),
                               edge.covariance.bottomRightCorner<3, 3>().trace()})
      if (!kVariance.contains(trace))
        throw std::runtime_error(file + ": edge " + to_string(edge.from) + " -> " +
                                 to_string(edge.to) + " has a variance of " + shortest_text(trace) +
                                 ", outside " + kVariance.text());
}

RecordedGraph make_recorded_graph(const G2oGraph& g2o, const std::string& file) {
  check_variances(g2o.edges, file);
  RecordedGraph graph = make_recorded_graph(g2o.edges, file);
  graph.dimension = g2o.dimension;
  graph.indefinite_edges = g2o.indefinite_edges;
  for (const G2oVertical& prior : g2o.verticals) {
    if (prior.id.robot != graph.robot || prior.id.index >= graph.poses())
      throw std::runtime_error(file + ": the prior on " + to_string(prior.id) +
                               " is on no keyframe of robot " + std::to_string(graph.robot));
    graph.verticals.emplace(prior.id.index, prior.vertical);
  }
  return graph;
}

}  // namespace

SE3 RecordedGraph::T_odom_first() const {
  const auto first = verticals.find(0);
  if (first == verticals.end()) return SE3::Identity();
  return make_pose(rotation_to_z(first->second.up_body), Eigen::Vector3d::Zero());
}

RecordedGraph in_space(RecordedGraph graph) {
  if (graph.dimension == 3) return graph;
  for (auto* edges : {&graph.odometry, &graph.intra_closures, &graph.inter_closures})
    for (RelativePose& e : *edges) e.covariance = covariance_of(planar_precision_of(e.covariance));
  return graph;
}

std::vector<OdometryPose> odometry_poses(const RecordedGraph& graph) {
  UncertainPose T_odom_kf{.T = graph.T_odom_first()};
  std::vector<OdometryPose> poses{{{graph.robot, 0}, T_odom_kf.T, Matrix6::Zero()}};
  for (const RelativePose& step : graph.odometry) {
    T_odom_kf = compose(T_odom_kf, {step.T_from_to, step.covariance});
    T_odom_kf.T.linear() = nearest_rotation(T_odom_kf.T.linear());
    poses.push_back({step.to, T_odom_kf.T, T_odom_kf.Sigma});
  }
  return poses;
}

RecordedGraph make_recorded_graph(const std::vector<RelativePose>& edges, const std::string& file) {
  RecordedGraph graph;
  graph.robot = owner(edges, file);
  std::vector<std::optional<RelativePose>> odometry(chain_length(edges, graph.robot, file));
  for (const RelativePose& edge : edges) {
    const bool from_here = edge.from.robot == graph.robot;
    const bool to_here = edge.to.robot == graph.robot;
    if (!from_here && !to_here)
      throw std::runtime_error(file + ": edge " + to_string(edge.from) + " -> " +
                               to_string(edge.to) + " does not touch robot " +
                               std::to_string(graph.robot));
    if (!from_here || !to_here)
      graph.inter_closures.push_back(edge);
    else if (edge.to.index == edge.from.index + 1 && !odometry[edge.from.index])
      odometry[edge.from.index] = edge;
    else
      graph.intra_closures.push_back(edge);
  }
  check_edges(edges, graph.robot, odometry.size(), file);
  for (KeyframeIndex k = 0; k < odometry.size(); ++k)
    graph.odometry.push_back(odometry[k] ? *odometry[k] : unknown_step({graph.robot, k}));
  return graph;
}

std::vector<RelativePose> parse_measurements(const std::string& text, const std::string& file) {
  std::string_view content = text;
  if (content.starts_with(kByteOrderMark)) content.remove_prefix(kByteOrderMark.size());
  if (!content.starts_with(kColumns))
    throw std::runtime_error(file + ":1: the first line must name the columns " +
                             std::string(kColumns));
  constexpr std::size_t kMaxFields = 256;
  RowReader table(text, kMaxFields);
  static_cast<void>(table.next());
  std::vector<RelativePose> rows;
  while (const auto row = table.next()) {
    TextFields fields(*row, file);
    rows.push_back(read_row(fields));
  }
  return rows;
}

RecordedGraph read_recorded_graph(const std::filesystem::path& file, std::optional<RobotId> robot) {
  const std::string name = file.string();
  if (file.extension() == ".jrl") {
    const JrlGraph team = read_jrl(file);
    if (!robot) throw std::runtime_error(name + ": holds several robots, and none is named");
    return part_of(team, *robot, name);
  }
  if (file.extension() != ".g2o" && file.extension() != ".csv")
    throw std::runtime_error(name + ": neither .g2o nor .csv nor .jrl");
  RecordedGraph graph =
      file.extension() == ".g2o"
          ? make_recorded_graph(read_g2o(file), name)
          : make_recorded_graph(parse_measurements(read_input_file(file), name), name);
  if (robot && graph.robot != *robot)
    throw std::runtime_error(name + " holds robot " + std::to_string(graph.robot) + ", not robot " +
                             std::to_string(*robot));
  return graph;
}

}  // namespace km
