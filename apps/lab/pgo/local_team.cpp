#include "apps/lab/pgo/local_team.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "modules/rbcd/truncated_newton.hpp"
#include "modules/tree_newton/chordal.hpp"

namespace km {
namespace {

constexpr Eigen::Index kRank = 3;
constexpr TruncatedNewtonOptions kExact{.max_iterations = 100,
                                        .max_cg_iterations = 1000,
                                        .cg_tolerance = 0.05,
                                        .gradient_tolerance = 1e-9,
                                        .relative_decrease_tolerance = 1e-9};

SE3 pose_at(const LiftedPoses& X, Eigen::Index i) {
  return make_pose(X.middleCols<3>(4 * i), X.col(4 * i + 3));
}

std::vector<SE3> start_of(const SessionGraph& part, Eigen::Index poses) {
  return levelled(chordal_initialisation(poses, part.own), part.verticals);
}

SE3 levelled_frame(const SE3& T, const Eigen::Vector3d& origin) {
  const Eigen::MatrixXd levelled = level(T.matrix().topRows<3>(), origin);
  return make_pose(levelled.leftCols<3>(), levelled.col(3));
}

}  // namespace

LocalTeam::LocalTeam(const TeamGraph& graph)
    : tree_(breadth_first_tree(neighbours_in(graph))), depth_(graph.robots(), 0) {
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    parts_.push_back(part_of(graph, k));
    std::erase_if(parts_[k].own, is_unknown_step);  // no measurement of this robot
    upright_ = upright_ && !parts_[k].verticals.empty();
    try {
      blocks_.push_back(lift(start_of(parts_[k], graph.poses_of(k)), kRank));
    } catch (const std::invalid_argument&) {
      throw std::invalid_argument("robot " + std::to_string(k) +
                                  " cannot solve alone: its own edges do not connect its poses");
    }
  }
  for (const std::size_t k : tree_.order)
    if (k != 0) depth_[k] = depth_[tree_.parent[k]] + 1;
}

int LocalTeam::step(RoundMeter& meter) {
  const std::size_t level = round_++;
  if (level > *std::max_element(depth_.begin(), depth_.end())) return 0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    if (level == 0) meter.run(k, [&] { solve(k); });
    if (level > 0 && depth_[k] == level) join(k, meter);
  }
  return 1;
}

void LocalTeam::solve(std::size_t k) {
  const SessionGraph& part = parts_[k];
  const Eigen::Index poses = pose_count(blocks_[k]);
  std::vector<BlockEdge> edges;
  for (const PoseEdge& e : part.own) edges.push_back(BlockEdge::of(e));
  const QuadraticProblem problem(kRank, poses, edges, {}, part.verticals);
  blocks_[k] = minimise(problem, lift(start_of(part, poses), kRank), kExact).X;
}

void LocalTeam::join(std::size_t k, RoundMeter& meter) {
  const std::size_t parent = tree_.parent[k];
  const RobotId self = parts_[k].self;
  const PoseEdge& closure = *std::ranges::find_if(
      parts_[k].between, [&](const PoseEdge& e) { return e.other(self).robot == parent; });
  const SE3 T_world_other = pose_at(blocks_[parent], closure.other(self).index);
  meter.sent(kMessageHeader + bytes_of_poses(1, kRank));
  meter.run(k, [&] {
    const SE3 T_other_own =
        closure.from.robot == self ? closure.T_from_to.inverse() : closure.T_from_to;
    const SE3 T_frame_own = pose_at(blocks_[k], closure.end_on(self).index);
    SE3 T_world_frame = T_world_other * T_other_own * T_frame_own.inverse();
    if (upright_) T_world_frame = levelled_frame(T_world_frame, T_frame_own.translation());
    for (Eigen::Index i = 0; i < pose_count(blocks_[k]); ++i)
      blocks_[k].middleCols<4>(4 * i) =
          (T_world_frame * pose_at(blocks_[k], i)).matrix().topRows<3>();
  });
}

}  // namespace km
