#include "modules/pose_graph/robust/central_gnc.hpp"

#include <utility>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/robust/gnc_team.hpp"
#include "modules/pose_graph/rounding.hpp"
#include "modules/pose_graph/truncated_newton.hpp"

namespace km {
namespace {

constexpr double kFinalTolerance = 1e-13;
constexpr double kRotationShift = 1e-9;  // of the preconditioner: soft modes are what is sought

std::vector<SE3> minimise_from(const TeamGraph& graph, std::vector<BlockEdge> edges,
                               const std::vector<SE3>& start, double tolerance) {
  QuadraticProblem problem(3, graph.poses(), std::move(edges), {});
  problem.set_rotation_shift(kRotationShift);
  const LiftedPoses X = minimise(problem, lift(start, 3),
                                 {.max_iterations = 50,
                                  .max_cg_iterations = 1000,
                                  .cg_tolerance = 1e-3,
                                  .gradient_tolerance = 1e-9,
                                  .relative_decrease_tolerance = tolerance})
                            .X;
  return round_to_poses(X, lifted_identity(3));
}

}  // namespace

CentralGnc gnc_centrally(const TeamGraph& graph, const GncAgentOptions& options, double tolerance,
                         std::vector<SE3> start) {
  const std::vector<bool> odometry = odometry_edges(graph);
  std::vector<std::size_t> edge_of;  // of each candidate
  std::vector<GncCandidate> candidates;
  std::vector<GncCandidate> joined;
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    const auto a = static_cast<RobotId>(graph.robot_of(graph.edges[k].i));
    const auto b = static_cast<RobotId>(graph.robot_of(graph.edges[k].j));
    if (odometry[k] && (a != b || !options.reject_odometry)) {
      joined.push_back({a, b});
      continue;
    }
    edge_of.push_back(k);
    candidates.push_back({a, b, odometry[k]});
  }
  GncSchedule schedule(std::move(candidates), graph.robots(), std::move(joined), options.gnc,
                       graph.dimension);
  std::vector<SE3> poses = std::move(start);
  if (poses.empty()) poses = chordal_initialisation(graph.poses(), graph.edges);
  while (!schedule.decided()) {
    std::vector<float> residuals;
    for (const std::size_t k : edge_of) {
      const BlockEdge& e = graph.edges[k];
      residuals.push_back(static_cast<float>(edge_residual(poses[static_cast<std::size_t>(e.i)],
                                                           poses[static_cast<std::size_t>(e.j)],
                                                           e.T_i_j, e.kappa, e.tau)));
    }
    (void)schedule.update(residuals);
    std::vector<double> weights(graph.edges.size(), 1.0);
    for (std::size_t c = 0; c < edge_of.size(); ++c) weights[edge_of[c]] = schedule.weight(c);
    std::vector<BlockEdge> edges;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      if (weights[k] == 0.0) continue;
      edges.push_back(graph.edges[k]);
      edges.back().kappa *= weights[k];
      edges.back().tau *= weights[k];
    }
    poses = minimise_from(graph, std::move(edges), poses,
                          schedule.decided() ? kFinalTolerance : tolerance);
  }
  CentralGnc result{.kept = std::vector<bool>(graph.edges.size(), true),
                    .T_world_kf = std::move(poses),
                    .updates = schedule.updates()};
  for (std::size_t c = 0; c < edge_of.size(); ++c) result.kept[edge_of[c]] = schedule.kept(c);
  return result;
}

}  // namespace km
