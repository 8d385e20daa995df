#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "apps/lab/pgo/solvers.hpp"
#include "apps/lab/pgo_study/member_team.hpp"
#include "apps/lab/pgo_study/odometry_start.hpp"
#include "modules/mesh_deformation/decimation.hpp"
#include "modules/mesh_deformation/interpolation.hpp"
#include "modules/mesh_deformation/local_mesh_optimizer.hpp"
#include "modules/pose_graph/tree_newton.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "test/modules/mesh_deformation/hilly_field.hpp"

// From new closures to bent meshes, for a team of three robots. Each robot maps the same square of
// 35 m with 500 keyframes and 500,000 vertices, on lanes that are turned by 90 degrees from robot
// to robot. The team solves its poses, then each robot solves its 2000 nodes and bends its mesh.
//
// Times are processor time of the critical path: of an exchange of messages the slowest robot, then
// the slowest robot's nodes. Cold: from odometry. Warm: from the solution without the last
// closures, with all closures weighed again. Latency of links is not included.

namespace km {
namespace {

using Eigen::Index;

constexpr std::size_t kRobots = 3;
constexpr Index kKeyframes = 500;
constexpr double kStepRotation_rad = 0.002, kStepTranslation_m = 0.01;
constexpr double kClosureRotation_rad = 0.005, kClosureTranslation_m = 0.03;
constexpr std::size_t kClosures = 400, kNewClosures = 20;
constexpr double kFalseShare = 0.05;
constexpr double kClosureReach_m = 5.2;  // the next lane, too

// The square that all robots map, their true keyframes, and the pose graph of the team.
struct Scene {
  HillyField field = hilly_field(708, kKeyframes, 7);
  std::vector<std::vector<SE3>> T_world_kf = {};  // true, by robot
  TeamGraph graph = {};
  std::size_t true_closures = 0;
};

SE3 noise(std::mt19937& rng, double rotation_rad, double translation_m) {
  Vector6 xi;
  xi.head<3>() = rotation_rad * random_vector<3>(rng);
  xi.tail<3>() = translation_m * random_vector<3>(rng);
  return se3_exp(xi);
}

// kappa and tau of errors with these standard deviations per axis.
BlockEdge edge(Index i, Index j, const SE3& T, double rotation_rad, double translation_m) {
  return {.i = i,
          .j = j,
          .T_i_j = T,
          .kappa = 0.5 / (rotation_rad * rotation_rad),
          .tau = 1.0 / (translation_m * translation_m)};
}

void add_odometry(Scene& scene) {
  const std::vector<SE3>& T_odom_kf = scene.field.T_odom_kf;
  scene.graph.first = {0};
  for (std::size_t k = 0; k < kRobots; ++k) {
    const Index first = scene.graph.first.back();
    for (Index i = 0; i < kKeyframes; ++i) {
      scene.graph.ids.push_back({static_cast<RobotId>(k), static_cast<KeyframeIndex>(i)});
      if (i == 0) continue;
      const auto now = static_cast<std::size_t>(i);
      scene.graph.edges.push_back(edge(first + i - 1, first + i,
                                       T_odom_kf[now - 1].inverse() * T_odom_kf[now],
                                       kStepRotation_rad, kStepTranslation_m));
    }
    scene.graph.first.push_back(first + kKeyframes);
  }
}

// Pairs of true keyframes that are near each other, of two robots or of two lanes.
std::vector<std::pair<Index, Index>> near_pairs(const std::vector<SE3>& T_world_kf) {
  std::vector<std::pair<Index, Index>> pairs;
  const auto count = static_cast<Index>(T_world_kf.size());
  for (Index i = 0; i < count; ++i)
    for (Index j = i + 1; j < count; ++j) {
      if (i / kKeyframes == j / kKeyframes && j - i < 20) continue;
      const auto at = [&](Index k) {
        return T_world_kf[static_cast<std::size_t>(k)].translation();
      };
      if ((at(i) - at(j)).norm() < kClosureReach_m) pairs.emplace_back(i, j);
    }
  return pairs;
}

void add_closures(Scene& scene, std::mt19937& rng) {
  std::vector<SE3> all;
  for (const auto& robot : scene.T_world_kf) all.insert(all.end(), robot.begin(), robot.end());
  std::vector<std::pair<Index, Index>> pairs = near_pairs(all);
  std::ranges::shuffle(pairs, rng);
  pairs.resize(std::min(pairs.size(), kClosures));
  std::bernoulli_distribution is_false(kFalseShare);
  for (const auto& [i, j] : pairs) {
    SE3 T = all[static_cast<std::size_t>(i)].inverse() * all[static_cast<std::size_t>(j)];
    if (is_false(rng))
      T = random_pose(rng, kClosureReach_m);
    else
      ++scene.true_closures;
    const SE3 error = noise(rng, kClosureRotation_rad, kClosureTranslation_m);
    scene.graph.edges.push_back(edge(i, j, T * error, kClosureRotation_rad, kClosureTranslation_m));
  }
}

// Odometry is the field's undistorted path, on which the mesh was made. The truth has the drift.
Scene make_scene(unsigned seed) {
  Scene scene;
  add_odometry(scene);
  const double half_m = 0.5 * 707 * 0.05;
  const Eigen::Vector3d middle(half_m, half_m, 0.0);
  for (std::size_t k = 0; k < kRobots; ++k) {
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(0.5 * std::numbers::pi * static_cast<double>(k), Eigen::Vector3d::UnitZ())
            .toRotationMatrix();
    const SE3 T_world_odom = make_pose(R, middle - R * middle);
    std::vector<SE3> T_world_kf =
        drifted(scene.field.T_odom_kf, static_cast<unsigned>(seed * kRobots + k), kStepRotation_rad,
                kStepTranslation_m);
    for (SE3& T : T_world_kf) T = T_world_odom * T;
    scene.T_world_kf.push_back(std::move(T_world_kf));
  }
  std::mt19937 rng(seed);
  add_closures(scene, rng);
  return scene;
}

// Solved poses of a team, by robot, and the processor time.
struct Session {
  std::vector<std::vector<SE3>> T_world_kf = {};
  double prepare_s = 0.0, rounds_s = 0.0, covariances_s = 0.0;
  std::uint32_t rounds = 0;
  std::size_t kept = 0;
  [[nodiscard]] double critical_s() const { return prepare_s + rounds_s + covariances_s; }
};

Session solve_team(const TeamGraph& graph, std::vector<SE3> start) {
  Session session;
  std::vector<const TreeNewton*> members(kRobots, nullptr);
  TreeNewtonOptions options = newton_options(PoseGraphConfig());
  options.dimension = graph.dimension;
  const TeamMeter clock{thread_cpu_s};
  RoundMeter meter(kRobots, clock);
  double start_s = thread_cpu_s();
  MemberTeam team(
      graph, 3, std::move(start),
      [&](SessionGraph part, TreePlace place) {
        const RobotId self = part.self;
        auto member = std::make_unique<TreeNewton>(std::move(part), std::move(place), options);
        members[self] = member.get();
        return member;
      },
      TeamShape::kAll, true);
  session.prepare_s = (thread_cpu_s() - start_s) / kRobots;  // robots prepare side by side
  while (team.step(meter) > 0) session.rounds_s += meter.finish_round().critical_path_s;
  session.rounds = team.rounds();
  const std::vector<bool> kept = team.kept();
  session.kept = static_cast<std::size_t>(std::ranges::count(kept, true)) -
                 kRobots * static_cast<std::size_t>(kKeyframes - 1);
  for (const TreeNewton* member : members) {
    session.T_world_kf.push_back(member->poses());
    start_s = thread_cpu_s();
    if (member->covariances().size() != member->poses().size()) std::abort();
    session.covariances_s = std::max(session.covariances_s, thread_cpu_s() - start_s);
  }
  return session;
}

std::vector<SE3> joined(const std::vector<std::vector<SE3>>& robots) {
  std::vector<SE3> all;
  for (const auto& robot : robots) all.insert(all.end(), robot.begin(), robot.end());
  return all;
}

// The graph without its last closures.
TeamGraph earlier(TeamGraph graph) {
  graph.edges.resize(graph.edges.size() - kNewClosures);
  return graph;
}

// Times of the mesh of the slowest robot.
struct MeshTimes {
  double nodes_cold_s = 0.0, nodes_warm_s = 0.0;  // solution of the deformation graph
  double all_cold_s = 0.0, all_warm_s = 0.0;      // LocalMeshOptimizer, from mesh to mesh
  double bend_s = 0.0;                            // equation (2) for all vertices
  std::size_t nodes = 0, vertices = 0;
};

MeshDeformationConfig mesh_config() {
  MeshDeformationConfig config;
  config.node_spacing_m = 0.72;
  return config;
}

// Calls `work` and returns its result; keeps the longest time in `worst_s`.
template <typename F>
auto timed(double& worst_s, F&& work) {
  const double start_s = thread_cpu_s();
  auto result = work();
  worst_s = std::max(worst_s, thread_cpu_s() - start_s);
  return result;
}

void time_mesh(const HillyField& field, const std::vector<SE3>& before,
               const std::vector<SE3>& after, MeshTimes& slowest) {
  LocalMeshOptimizer optimizer(mesh_config());
  const auto optimize = [&](const std::vector<SE3>& T_world_kf) {
    return optimizer.optimize(field.map, field.T_odom_kf, T_world_kf).report;
  };
  slowest.nodes = timed(slowest.all_cold_s, [&] { return optimize(before); }).nodes;
  slowest.vertices = timed(slowest.all_warm_s, [&] { return optimize(after); }).vertices;
}

// The parts of LocalMeshOptimizer that depend on the poses.
void time_parts(const HillyField& field, const std::vector<SE3>& before,
                const std::vector<SE3>& after, MeshTimes& slowest) {
  const MeshDeformationConfig config = mesh_config();
  const auto window = static_cast<KeyframeIndex>(config.time_window_keyframes);
  SimplifiedMesh simplified;
  extend(simplified, field.map, {config.node_spacing_m, window});
  DeformationGraph graph;
  for (const MeshNode& node : simplified.nodes) graph.nodes.push_back(node.position);
  graph.T_odom_kf = field.T_odom_kf;
  graph.edges = region_edges(simplified, field.map.mesh.faces, window);
  graph.keyframe_edges = choose_keyframe_edges(
      simplified.nodes, static_cast<std::size_t>(config.keyframes_per_node), window);
  const DeformationNoise noise{config.anchor_rotation_rad, config.anchor_translation_m,
                               config.mesh_edge_m, config.keyframe_edge_m};
  const DeformationStop stop{config.max_iterations, config.energy_tolerance};
  const DeformationSolution cold = timed(slowest.nodes_cold_s, [&] {
    return solve(graph, before, noise, stop, initial_poses(graph, before));
  });
  const DeformationSolution warm = timed(slowest.nodes_warm_s, [&] {
    return solve(graph, after, noise, stop, warm_start_poses(graph, cold.poses, before, after));
  });
  Interpolation interpolation(static_cast<std::size_t>(config.interpolation_nodes), window);
  interpolation.bind(field.map.mesh.vertices, field.map.seen_by, simplified.nodes);
  (void)timed(slowest.bend_s, [&] {
    return interpolation.deform(field.map.mesh.vertices, field.map.seen_by, simplified.nodes,
                                warm.poses.T_world_node, after);
  });
}

void run(unsigned seed) {
  const Scene scene = make_scene(seed);
  const TeamGraph old_graph = earlier(scene.graph);
  const Session cold = solve_team(old_graph, odometry_start(old_graph));
  const Session warm = solve_team(scene.graph, joined(cold.T_world_kf));
  MeshTimes mesh;
  for (std::size_t k = 0; k < kRobots; ++k) {
    time_mesh(scene.field, cold.T_world_kf[k], warm.T_world_kf[k], mesh);
    time_parts(scene.field, cold.T_world_kf[k], warm.T_world_kf[k], mesh);
  }
  std::printf(
      "%4u  %3zu/%zu  %5zu %7zu |%3u %6.3f %6.3f %6.3f |%3u %6.3f %6.3f %6.3f | %6.3f %6.3f "
      "%6.3f\n",
      seed, warm.kept, scene.true_closures, mesh.nodes, mesh.vertices, cold.rounds,
      cold.critical_s(), mesh.nodes_cold_s, cold.critical_s() + mesh.nodes_cold_s, warm.rounds,
      warm.critical_s(), mesh.nodes_warm_s, warm.critical_s() + mesh.nodes_warm_s, mesh.bend_s,
      mesh.all_cold_s, mesh.all_warm_s);
  std::fflush(stdout);
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) {
  const unsigned seeds = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 5;
  std::printf(
      "seconds of processor time, slowest robot; poses: rounds, then s\n"
      "seed kept/true nodes vertices | cold: poses, nodes, both | warm: poses, nodes, both "
      "| bend; mesh to mesh cold, warm\n");
  for (unsigned seed = 1; seed <= seeds; ++seed) km::run(seed);
}
