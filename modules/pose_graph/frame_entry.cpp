#include "modules/pose_graph/frame_entry.hpp"

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/closure_places.hpp"
#include "modules/pose_graph/rounding.hpp"
#include "modules/pose_graph/truncated_newton.hpp"

namespace km {
namespace {

constexpr int kBendingSteps = 10;
constexpr int kBendingProducts = 50;  // Hessian products in each Newton step
constexpr Eigen::Index kRank = 3;     // rigid poses, not lifted

std::vector<BlockEdge> block_edges(std::span<const PoseEdge> own) {
  std::vector<BlockEdge> edges;
  for (const PoseEdge& e : own)
    edges.push_back({e.from.index, e.to.index, e.T_from_to, e.precision.kappa, e.precision.tau});
  return edges;
}

std::vector<SE3> plain_poses(const LiftedPoses& X) {
  return round_to_poses(X, lifted_identity(kRank));
}

}  // namespace

std::optional<std::vector<SE3>> moved_into_frame(const std::vector<SE3>& poses, RobotId self,
                                                 std::span<const PoseEdge> closures,
                                                 const std::map<KeyframeId, SE3>& told,
                                                 const AlignmentTolerance& tolerance) {
  std::vector<PoseEdge> heard;
  SE3 T_own_centre = SE3::Identity();
  for (const PoseEdge& e : closures) {
    if (!told.contains(e.other(self))) continue;
    heard.push_back(e);
    T_own_centre.translation() += poses[e.end_on(self).index].translation();
  }
  if (heard.empty()) return std::nullopt;
  T_own_centre.translation() /= static_cast<double>(heard.size());
  std::vector<Eigen::MatrixXd> candidates;
  for (const PoseEdge& e : heard) {
    const SE3& T_frame_other = told.at(e.other(self));
    const SE3 T_other_kf = e.from.robot == self ? e.T_from_to.inverse() : e.T_from_to;
    const SE3& T_own_kf = poses[e.end_on(self).index];
    const SE3 T_frame_centre = T_frame_other * T_other_kf * T_own_kf.inverse() * T_own_centre;
    candidates.emplace_back(T_frame_centre.matrix().topRows<3>());
  }
  const auto alignment = align_frames(candidates, tolerance, find_places(heard).weights());
  const SE3 T_frame_own =
      make_pose(alignment->L.leftCols<3>(), alignment->L.col(3)) * T_own_centre.inverse();
  std::vector<SE3> moved;
  moved.reserve(poses.size());
  for (const SE3& T_own_kf : poses) moved.push_back(T_frame_own * T_own_kf);
  return moved;
}

std::vector<SE3> bent_to_told(const std::vector<SE3>& poses, RobotId self,
                              std::span<const PoseEdge> own, std::span<const PoseEdge> closures,
                              const std::map<KeyframeId, SE3>& told) {
  std::vector<PublicEdge> to_told;
  std::vector<SE3> fixed;
  for (const PoseEdge& e : closures) {
    const auto other = told.find(e.other(self));
    if (other == told.end()) continue;
    to_told.push_back({e.end_on(self).index, static_cast<Eigen::Index>(fixed.size()),
                       e.from.robot == self, e.T_from_to, e.precision.kappa, e.precision.tau});
    fixed.push_back(other->second);
  }
  QuadraticProblem problem(kRank, static_cast<Eigen::Index>(poses.size()), block_edges(own),
                           std::move(to_told));
  problem.set_fixed(lift(fixed, kRank));
  return plain_poses(
      minimise(problem, lift(poses, kRank),
               {.max_iterations = kBendingSteps, .max_cg_iterations = kBendingProducts})
          .X);
}

std::vector<SE3> better_of_chordal(std::vector<SE3> poses, std::span<const PoseEdge> own) {
  const std::vector<BlockEdge> edges = block_edges(own);
  const auto count = static_cast<Eigen::Index>(poses.size());
  std::vector<SE3> chordal = chordal_initialisation(count, edges);
  for (SE3& T : chordal) T = poses.front() * T;
  const QuadraticProblem problem(kRank, count, edges, {});
  const bool better = problem.cost(lift(chordal, kRank)) < problem.cost(lift(poses, kRank));
  return better ? chordal : poses;
}

}  // namespace km
