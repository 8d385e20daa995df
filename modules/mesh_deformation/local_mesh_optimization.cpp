#include "modules/mesh_deformation/local_mesh_optimization.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "modules/mesh_deformation/decimation.hpp"
#include "modules/mesh_deformation/interpolation.hpp"

namespace km {
namespace {

constexpr std::size_t kKeyframesPerNode = 4;  // at most, which hold a node
constexpr double kRigidTolerance = 1e-6;      // entries of R^T R

[[noreturn]] void refuse(const std::string& problem) {
  throw std::invalid_argument("mesh deformation: " + problem);
}

void check(const MapMesh& map, std::size_t keyframes) {
  if (const char* fault = fault_of(map)) refuse(fault);
  for (const auto& [first, last] : map.seen_by)
    if (first > last || last >= keyframes)
      refuse("a vertex was seen by keyframes " + std::to_string(first) + " to " +
             std::to_string(last) + ", of " + std::to_string(keyframes));
}

void check_poses(std::span<const SE3> poses, const char* what) {
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!is_rigid(poses[i], kRigidTolerance))
      refuse(std::string(what) + " pose of keyframe " + std::to_string(i) +
             " is not finite or not rigid");
}

DeformationGraph make_graph(const SimplifiedMesh& simplified, const MapMesh& map,
                            std::span<const SE3> T_odom_kf, KeyframeIndex window) {
  DeformationGraph graph;
  graph.nodes.reserve(simplified.nodes.size());
  for (const MeshNode& node : simplified.nodes) graph.nodes.push_back(node.position);
  graph.T_odom_kf.assign(T_odom_kf.begin(), T_odom_kf.end());
  graph.edges = region_edges(simplified, map.mesh.faces, window);
  graph.keyframe_edges = choose_keyframe_edges(simplified.nodes, kKeyframesPerNode, window);
  return graph;
}

}  // namespace

void check_trajectories(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf) {
  check_poses(T_odom_kf, "odometry");
  check_poses(T_world_kf, "optimised");
  if (T_world_kf.size() > T_odom_kf.size() || (T_world_kf.empty() && !T_odom_kf.empty()))
    refuse(std::to_string(T_world_kf.size()) + " optimised poses for " +
           std::to_string(T_odom_kf.size()) + " keyframes");
}

std::vector<SE3> complete(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf) {
  std::vector<SE3> result(T_world_kf.begin(), T_world_kf.end());
  if (T_odom_kf.empty()) return result;
  const std::size_t last = T_world_kf.size() - 1;
  const SE3 T_world_odom = T_world_kf[last] * T_odom_kf[last].inverse();
  for (std::size_t i = T_world_kf.size(); i < T_odom_kf.size(); ++i)
    result.push_back(T_world_odom * T_odom_kf[i]);
  return result;
}

DeformedMesh optimize_mesh(const MapMesh& map, std::span<const SE3> T_odom_kf,
                           std::span<const SE3> T_world_kf, const MeshDeformationConfig& config) {
  check_trajectories(T_odom_kf, T_world_kf);
  check(map, T_odom_kf.size());
  const auto window = static_cast<KeyframeIndex>(config.time_window_keyframes);
  const SimplifiedMesh simplified = simplify(map, {config.node_spacing_m, window});
  const DeformationGraph graph = make_graph(simplified, map, T_odom_kf, window);
  const std::vector<SE3> anchors = complete(T_odom_kf, T_world_kf);
  const DeformationSolution solution = solve(graph, anchors, {}, {}, initial_poses(graph, anchors));

  // Correction at each keyframe, which moves vertices without a node.
  std::vector<SE3> T_world_odom;
  for (std::size_t i = 0; i < anchors.size(); ++i)
    T_world_odom.push_back(anchors[i] * T_odom_kf[i].inverse());
  const std::vector<Binding> bindings =
      bind_to_nodes(map.mesh.vertices, map.seen_by, simplified.nodes, kMaxNeighbours, window);
  DeformedMesh result{map.mesh, {}};
  result.mesh.vertices = deform_vertices(map.mesh.vertices, map.seen_by, simplified.nodes, bindings,
                                         solution.poses.T_world_node, T_world_odom);
  result.report = {.vertices = map.mesh.vertices.size(),
                   .unbound_vertices = static_cast<std::size_t>(
                       std::ranges::count(bindings, false, &Binding::is_bound)),
                   .nodes = graph.nodes.size(),
                   .keyframes = T_odom_kf.size(),
                   .status = solution.status,
                   .iterations = solution.iterations};
  return result;
}

}  // namespace km
