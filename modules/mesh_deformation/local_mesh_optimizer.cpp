#include "modules/mesh_deformation/local_mesh_optimizer.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "modules/mesh_deformation/decimation.hpp"
#include "modules/mesh_deformation/interpolation.hpp"
#include "modules/mesh_deformation/keyframe_motion.hpp"

namespace km {
namespace {

constexpr std::size_t kInterpolationNodes = 4;  // nodes that move a vertex: the paper's k
constexpr std::size_t kKeyframesPerNode = 4;    // at most, which hold a node
constexpr double kRigidTolerance = 1e-6;        // entries of R^T R

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

bool is_rigid(const SE3& T) {
  const Eigen::Matrix3d R = T.linear();
  if (!T.matrix().allFinite() || R.determinant() < 0.0) return false;
  return (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRigidTolerance;
}

void check_poses(std::span<const SE3> poses, const char* what) {
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!is_rigid(poses[i]))
      refuse(std::string(what) + " pose of keyframe " + std::to_string(i) +
             " is not finite or not rigid");
}

// Correspondence of the vertices of two versions of a mesh.
struct VertexMatch {
  std::vector<std::uint32_t> before;     // old index of each new vertex, or kNoIndex
  std::vector<std::uint32_t> unchanged;  // `before`, but kNoIndex if position or seen_by differ
  std::vector<std::uint32_t> after;      // new index of each old vertex, or kNoIndex
};

// Stored properties of the last mesh.
struct KnownVertices {
  std::vector<Eigen::Vector3f> positions;
  std::vector<SeenBy> seen_by;
  std::vector<std::uint64_t> ids;
};

// For each new vertex the index of the old vertex with its id, or kNoIndex. Both lists ascend.
std::vector<std::uint32_t> match_ids(const std::vector<std::uint64_t>& old_ids,
                                     const std::vector<std::uint64_t>& new_ids) {
  std::vector<std::uint32_t> before(new_ids.size(), kNoIndex);
  std::uint32_t old = 0;
  for (std::size_t v = 0; v < new_ids.size(); ++v) {
    while (old < old_ids.size() && old_ids[old] < new_ids[v]) ++old;
    if (old < old_ids.size() && old_ids[old] == new_ids[v]) before[v] = old;
  }
  return before;
}

VertexMatch match(const KnownVertices& known, const MapMesh& map) {
  VertexMatch match;
  match.before.assign(map.mesh.vertices.size(), kNoIndex);
  if (!known.ids.empty() && !map.ids.empty()) match.before = match_ids(known.ids, map.ids);
  match.unchanged = match.before;
  match.after.assign(known.positions.size(), kNoIndex);
  for (std::uint32_t v = 0; v < match.before.size(); ++v) {
    const std::uint32_t old = match.before[v];
    if (old == kNoIndex) continue;
    match.after[old] = v;
    if (known.positions[old] != map.mesh.vertices[v] || known.seen_by[old] != map.seen_by[v])
      match.unchanged[v] = kNoIndex;
  }
  return match;
}

}  // namespace

void check_trajectories(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf) {
  check_poses(T_odom_kf, "odometry");
  check_poses(T_world_kf, "optimised");
  if (T_world_kf.size() > T_odom_kf.size() || (T_world_kf.empty() && !T_odom_kf.empty()))
    refuse(std::to_string(T_world_kf.size()) + " optimised poses for " +
           std::to_string(T_odom_kf.size()) + " keyframes");
}

struct LocalMeshOptimizer::State {
  State(const MeshDeformationConfig& c, const DeformationStop& s)
      : config(checked(c)),
        stop(s),
        window(static_cast<KeyframeIndex>(config.time_window_keyframes)),
        interpolation(kInterpolationNodes, window) {}

  // Updates the vertex and seen_by of each node. Returns the nodes whose seen_by has changed.
  std::vector<std::uint32_t> follow_vertices(const VertexMatch& matched, const MapMesh& map);

  // True if more than half as many vertices have been removed as remain. Many nodes then represent
  // little surface, or none.
  [[nodiscard]] bool outgrown() const { return 2 * gone > known.positions.size(); }

  // Updates nodes, regions and bindings for `map`. Returns the number of new nodes.
  std::size_t take_over(const MapMesh& map);

  [[nodiscard]] DeformationGraph make_graph(const MapMesh& map,
                                            std::span<const SE3> T_odom_kf) const;

  MeshDeformationConfig config;
  DeformationStop stop;
  KeyframeIndex window;
  Interpolation interpolation;
  KnownVertices known;
  std::size_t gone = 0;  // number of vertices that were removed
  SimplifiedMesh simplified;
  bool solved = false;
  DeformationPoses last;             // last solution
  std::vector<SE3> T_world_kf_last;  // anchors of `last`
};

std::vector<std::uint32_t> LocalMeshOptimizer::State::follow_vertices(const VertexMatch& matched,
                                                                      const MapMesh& map) {
  std::vector<std::uint32_t> seen_again;
  for (std::uint32_t n = 0; n < simplified.nodes.size(); ++n) {
    MeshNode& node = simplified.nodes[n];
    if (node.vertex == kNoIndex) continue;
    node.vertex = matched.after[node.vertex];
    if (node.vertex == kNoIndex) continue;
    const auto [first, last_seen] = map.seen_by[node.vertex];
    const SeenBy joined = {std::min(first, node.seen_by[0]), std::max(last_seen, node.seen_by[1])};
    if (joined != node.seen_by) seen_again.push_back(n);
    node.seen_by = joined;
  }
  return seen_again;
}

std::size_t LocalMeshOptimizer::State::take_over(const MapMesh& map) {
  const VertexMatch matched = match(known, map);
  std::vector<std::uint32_t> changed = follow_vertices(matched, map);

  std::vector<std::uint32_t> node_of_vertex(map.mesh.vertices.size(), kNoIndex);
  for (std::size_t v = 0; v < node_of_vertex.size(); ++v)
    if (matched.before[v] != kNoIndex)
      node_of_vertex[v] = simplified.node_of_vertex[matched.before[v]];
  simplified.node_of_vertex = std::move(node_of_vertex);

  const std::size_t old_nodes = simplified.nodes.size();
  extend(simplified, map, {config.node_spacing_m, window});
  for (std::size_t n = old_nodes; n < simplified.nodes.size(); ++n)
    changed.push_back(static_cast<std::uint32_t>(n));

  interpolation.update(map.mesh.vertices, map.seen_by, simplified.nodes, matched.unchanged,
                       changed);
  known = {map.mesh.vertices, map.seen_by, map.ids};
  gone +=
      static_cast<std::size_t>(std::count(matched.after.begin(), matched.after.end(), kNoIndex));
  return simplified.nodes.size() - old_nodes;
}

DeformationGraph LocalMeshOptimizer::State::make_graph(const MapMesh& map,
                                                       std::span<const SE3> T_odom_kf) const {
  DeformationGraph graph;
  graph.nodes.reserve(simplified.nodes.size());
  for (const MeshNode& node : simplified.nodes) graph.nodes.push_back(node.position);
  graph.T_odom_kf.assign(T_odom_kf.begin(), T_odom_kf.end());
  graph.edges = region_edges(simplified, map.mesh.faces, window);
  graph.keyframe_edges = choose_keyframe_edges(simplified.nodes, kKeyframesPerNode, window);
  return graph;
}

LocalMeshOptimizer::LocalMeshOptimizer(const MeshDeformationConfig& config,
                                       const DeformationStop& stop)
    : state_(std::make_unique<State>(config, stop)) {}
LocalMeshOptimizer::~LocalMeshOptimizer() = default;
LocalMeshOptimizer::LocalMeshOptimizer(LocalMeshOptimizer&&) noexcept = default;
LocalMeshOptimizer& LocalMeshOptimizer::operator=(LocalMeshOptimizer&&) noexcept = default;

DeformedMesh LocalMeshOptimizer::optimize(const MapMesh& map, std::span<const SE3> T_odom_kf,
                                          std::span<const SE3> T_world_kf) {
  check_trajectories(T_odom_kf, T_world_kf);
  check(map, T_odom_kf.size());
  if (T_odom_kf.size() < state_->T_world_kf_last.size())
    throw std::invalid_argument("mesh deformation: " + std::to_string(T_odom_kf.size()) +
                                " keyframes, fewer than the " +
                                std::to_string(state_->T_world_kf_last.size()) + " before");
  DeformedMesh result;
  MeshDeformationReport& report = result.report;

  report.new_nodes = state_->take_over(map);
  if (state_->outgrown()) {
    reset();
    report.new_nodes = state_->take_over(map);
  }
  State& state = *state_;
  const DeformationGraph graph = state.make_graph(map, T_odom_kf);
  const std::vector<SE3> anchors = complete(T_odom_kf, T_world_kf);
  report.warm = state.solved;
  DeformationPoses initial =
      state.solved ? warm_start_poses(graph, state.last, state.T_world_kf_last, anchors)
                   : initial_poses(graph, anchors);
  DeformationSolution solution = solve(graph, anchors, {}, state.stop, std::move(initial));

  // Correction at each keyframe, which moves vertices without a node.
  std::vector<SE3> T_world_odom;
  for (std::size_t i = 0; i < anchors.size(); ++i)
    T_world_odom.push_back(anchors[i] * T_odom_kf[i].inverse());
  result.mesh = map.mesh;
  result.mesh.vertices =
      state.interpolation.deform(map.mesh.vertices, map.seen_by, state.simplified.nodes,
                                 solution.poses.T_world_node, T_world_odom);

  report.vertices = map.mesh.vertices.size();
  report.unbound_vertices = state.interpolation.unbound_count();
  report.nodes = graph.nodes.size();
  report.keyframes = T_odom_kf.size();
  report.status = solution.status;
  report.iterations = solution.iterations;
  state.last = std::move(solution.poses);
  state.T_world_kf_last = anchors;
  state.solved = true;
  return result;
}

void LocalMeshOptimizer::reset() {
  state_ = std::make_unique<State>(state_->config, state_->stop);
}

}  // namespace km
