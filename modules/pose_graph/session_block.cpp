#include "modules/pose_graph/session_block.hpp"

#include <algorithm>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/rounding.hpp"

namespace km {
namespace {

// Of a block when it enters a frame, see perturb_rotations(): small beside any measurement, large
// beside rounding. One block out of its subspace draws its neighbours out of theirs.
constexpr double kPerturbation = 1e-3;
constexpr unsigned kPerturbationSeed = 1;

}  // namespace

double growing_relaxation(std::uint32_t round, double max) {
  return std::min(max, 2.0 - 4.0 / (8.0 + round));
}

SessionBlock::SessionBlock(LiftedPoses X, std::vector<BlockEdge> own_edges,
                           const std::map<RobotId, std::vector<InterEdge>>& edges_to,
                           std::vector<VerticalPrior> verticals)
    : X_(std::move(X)),
      problem_(X_.rows(), pose_count(X_), std::move(own_edges), make_public_edges(edges_to),
               std::move(verticals)) {
  Eigen::Index slots = 0;
  for (const auto& [robot, of_robot] : neighbours_)
    slots += static_cast<Eigen::Index>(of_robot.of_keyframe.size());
  fixed_ = LiftedPoses::Zero(X_.rows(), 4 * slots);
}

std::vector<PublicEdge> SessionBlock::make_public_edges(
    const std::map<RobotId, std::vector<InterEdge>>& edges_to) {
  std::vector<PublicEdge> public_edges;
  std::set<std::uint32_t> own{0};
  Eigen::Index slots = 0;
  for (const auto& [robot, edges] : edges_to) {
    auto& slot_of = neighbours_[robot].of_keyframe;
    for (const InterEdge& e : edges) {
      const auto [slot, is_new] = slot_of.try_emplace(e.other, slots);
      if (is_new) ++slots;
      public_edges.push_back({e.own, slot->second, e.from_own, e.T_from_to, e.kappa, e.tau});
      robot_of_edge_.push_back(robot);
      own.insert(e.own);
    }
  }
  public_.assign(own.begin(), own.end());
  return public_edges;
}

bool SessionBlock::set_neighbour(RobotId robot, const std::vector<std::uint32_t>& keyframes,
                                 const LiftedPoses& X) {
  const auto found = neighbours_.find(robot);
  if (found == neighbours_.end()) return true;
  auto& slots = found->second;
  LiftedPoses fixed = fixed_;
  for (const auto& [keyframe, slot] : slots.of_keyframe) {
    const auto at = std::lower_bound(keyframes.begin(), keyframes.end(), keyframe);
    if (at == keyframes.end() || *at != keyframe) return false;
    fixed.middleCols<4>(4 * slot) = X.middleCols<4>(4 * (at - keyframes.begin()));
  }
  fixed_ = std::move(fixed);
  slots.set = true;
  fixed_changed_ = true;
  return true;
}

Eigen::MatrixXd SessionBlock::align_rigidly(const std::vector<PublicEdge>& edges,
                                            const std::vector<SE3>& poses,
                                            const AlignmentTolerance& tolerance) const {
  // Candidates for the frame at the centre of the closures' own ends, see align_frames().
  SE3 T_own_centre = SE3::Identity();
  for (const PublicEdge& e : edges)
    T_own_centre.translation() += poses[static_cast<std::size_t>(e.own)].translation();
  T_own_centre.translation() /= static_cast<double>(edges.size());
  std::vector<Eigen::MatrixXd> candidates;
  for (const PublicEdge& e : edges) {
    const SE3 T_fixed_own = e.from_own ? e.T.inverse() : e.T;
    const SE3& T_own_kf = poses[static_cast<std::size_t>(e.own)];
    candidates.push_back(
        lift(fixed_.middleCols<4>(4 * e.fixed), T_fixed_own * T_own_kf.inverse() * T_own_centre));
  }
  const auto alignment = align_frames(candidates, tolerance);
  return lift(alignment->L, T_own_centre.inverse());
}

void SessionBlock::align(const AlignmentTolerance& tolerance,
                         const TruncatedNewtonOptions& options) {
  std::vector<PublicEdge> heard;
  for (std::size_t k = 0; k < robot_of_edge_.size(); ++k)
    if (neighbours_.at(robot_of_edge_[k]).set) heard.push_back(problem_.public_edges()[k]);
  const std::vector<SE3> poses = round_to_poses(X_, X_.leftCols<4>());
  const Eigen::MatrixXd L = align_rigidly(heard, poses, tolerance);
  for (std::size_t i = 0; i < poses.size(); ++i)
    X_.middleCols<4>(4 * static_cast<Eigen::Index>(i)) = lift(L, poses[i]);
  std::mt19937 rng(kPerturbationSeed);
  X_ = perturb_rotations(X_, kPerturbation, rng);
  QuadraticProblem problem(X_.rows(), pose_count(X_), problem_.edges(), heard,
                           problem_.verticals());
  problem.set_fixed(fixed_);
  X_ = minimise(problem, std::move(X_), options).X;
}

TruncatedNewtonResult SessionBlock::update(const TruncatedNewtonOptions& options,
                                           double relaxation) {
  TruncatedNewtonResult result = minimise_beyond(problem(), X_, options, relaxation);
  X_ = result.X;
  return result;
}

LiftedPoses SessionBlock::round_public_poses() {
  LiftedPoses rounded(X_.rows(), 4 * static_cast<Eigen::Index>(public_.size()));
  for (std::size_t k = 0; k < public_.size(); ++k)
    rounded.middleCols<4>(4 * static_cast<Eigen::Index>(k)) =
        X_.middleCols<4>(4 * Eigen::Index{public_[k]}).cast<float>().cast<double>();
  const LiftedPoses feasible = restore_stiefel(rounded);
  for (std::size_t k = 0; k < public_.size(); ++k)
    X_.middleCols<4>(4 * Eigen::Index{public_[k]}) =
        feasible.middleCols<4>(4 * static_cast<Eigen::Index>(k));
  return rounded;
}

void SessionBlock::offer(LiftedPoses X) {
  if (problem_.cost(X) < problem_.cost(X_)) X_ = std::move(X);
}

const QuadraticProblem& SessionBlock::problem() {
  if (fixed_changed_) problem_.set_fixed(fixed_);
  fixed_changed_ = false;
  return problem_;
}

double SessionBlock::gradient_norm() {
  return project_tangent(X_, problem().euclidean_gradient(X_)).norm();
}

double SessionBlock::share_of_cost(const std::set<RobotId>& counted) const {
  double cost = problem_.cost(X_);
  for (std::size_t k = 0; k < robot_of_edge_.size(); ++k)
    if (!counted.contains(robot_of_edge_[k])) cost -= problem_.public_edge_cost(k, X_);
  return cost;
}

std::set<RobotId> SessionBlock::neighbours() const {
  std::set<RobotId> robots;
  for (const auto& [robot, slots] : neighbours_) robots.insert(robot);
  return robots;
}

}  // namespace km
