#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "modules/robust/member_solver.hpp"
#include "modules/robust/session_graph.hpp"
#include "modules/robust/tree_messages.hpp"
#include "modules/robust/tree_root.hpp"
#include "modules/tree_newton/tree_front.hpp"

namespace km {

/// The part of one robot in a robust Newton method for the pose graph of a team, up and down a tree
/// of robots. README.md describes a round, and METHOD.md the weights.
///
/// A step is accepted once the next pass up has brought its cost to the root. If the cost has
/// risen, the step is shortened; while weights change, the cost may rise by half, twice in a row.
/// Only the root decides. Second derivatives hardly change (see edge_model.hpp), so old ones serve
/// several steps (Shamanskii's variant of Newton's method). The first ones are those of
/// Gauss-Newton, which cannot be indefinite.
///
/// In a second look (SessionGraph::again), a pair with undecided closures weighs its closures
/// again, except for the rejected ones. A closure to a held pose is left out if an earlier session
/// has rejected it, and otherwise has weight 1.
///
/// Exactly one of two robots weighs a closure between them and has it among its own edges. The
/// system up the tree contains the pose at the other end. Between a parent and its child the parent
/// weighs, so that the second derivatives of the child do not change with weights. In other pairs
/// one end of each closure is chosen by a vertex cover, equal on both robots.
class TreeNewton final : public MemberSolver {
 public:
  /// Throws std::invalid_argument if an edge is not usable or a public pose is missing.
  TreeNewton(SessionGraph graph, TreePlace place, const TreeNewtonOptions& options);

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool ready() const override;
  [[nodiscard]] std::vector<SolverMessage> advance() override;
  [[nodiscard]] bool done() const override { return phase_ == Phase::kDone; }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return accepted_; }
  [[nodiscard]] std::vector<Matrix6> covariances() const override { return covariances_; }
  [[nodiscard]] SolverState state() const override { return state_; }
  [[nodiscard]] ClosureVerdicts verdicts() const override;
  [[nodiscard]] ClosureNoiseRecord noise() const override { return graph_.noise; }

 private:
  enum class Phase { kUp, kDown, kDone };
  /// kFixed: not weighed. kOpen: may be rejected. kRejected: by the first look.
  enum class Trust { kFixed, kOpen, kRejected };
  /// An edge that this robot knows. The other robot of the edge may be the one that weighs it.
  struct Known {
    PoseEdge edge;
    Trust trust = Trust::kFixed;
    bool deferred = false;  ///< Stands alone: deferred in this session.
    /// Decided by the start: open, but not weighed unless the solution contradicts it.
    bool settled = false;
    bool contradicted = false;  ///< The present poses contradict its decided weight.
    bool odometry = false;
    bool own = true;           ///< This robot weighs it.
    double weight = 1.0;       ///< Weight at the accepted poses.
    double candidate = 1.0;    ///< At the present poses.
    double pair_limit = 1.0;   ///< Factor on the weight while the pair of the edge is limited.
    double pair_factor = 1.0;  ///< `pair_limit` or 1: factor on the weight at the accepted poses.
    double candidate_pair_factor = 1.0;  ///< At the present poses.
  };

  void classify();
  [[nodiscard]] bool takes_part(const Known& k) const {
    return k.trust != Trust::kRejected && !k.deferred;
  }
  [[nodiscard]] bool reports(const Known& k) const;
  /// The other robot of the edge; this robot for an edge inside it.
  [[nodiscard]] RobotId peer_of(const Known& k) const;
  [[nodiscard]] const SE3& start_of(const KeyframeId& id) const;
  [[nodiscard]] std::map<RobotId, std::vector<std::size_t>> by_peer() const;
  [[nodiscard]] std::vector<SE3> odometry_poses() const;
  [[nodiscard]] std::function<SE3(const KeyframeId&)> pose_before_closures(
      RobotId peer, const std::vector<SE3>& odometry) const;
  void weaken_odometry();
  void weigh_by_noise();
  void weigh_by_usual_noise();
  void weaken(std::span<const std::size_t> closures, double factor);
  void find_isolated(double barc);
  [[nodiscard]] std::map<RobotId, double> limits_of_pairs() const;
  void settle();
  void unsettle();
  void build_front();
  void return_to_start();
  void share_closures(std::map<KeyframeIndex, std::uint32_t>& touched_by);
  [[nodiscard]] const SE3& pose_at(const KeyframeId& id, const std::vector<SE3>& poses) const;
  [[nodiscard]] std::vector<double> front_weights(bool candidate) const;

  [[nodiscard]] UpMessage first_message();
  void count_closures(TreeSums& sums) const;
  void move_robots(const std::vector<std::pair<RobotId, SinglePose>>& moves);
  [[nodiscard]] UpMessage equations();
  void weigh_candidates(TreeSums& sums);
  void limit_candidates(bool decided);
  [[nodiscard]] std::set<RobotId> contradicted_pairs() const;
  [[nodiscard]] std::vector<SolverMessage> go_up();
  [[nodiscard]] bool can_follow(const DownMessage& message) const;
  [[nodiscard]] std::vector<SolverMessage> go_down(const DownMessage& message);
  void take_step(const Eigen::VectorXd& step, const TreeVerdict& verdict,
                 std::map<RobotId, Eigen::VectorXd>& children);
  void accept();
  void finish();
  void compute_covariances(const TreeInverse& from_parent);

  SessionGraph graph_;
  TreePlace place_;
  TreeNewtonOptions options_;
  std::size_t inside_ = 0;    // number of edges inside this robot
  std::vector<Known> known_;  // these edges, then those between robots
  std::optional<TreeFront> front_;
  std::vector<std::size_t> front_edge_;  // index in known_ of each edge of the front

  Phase phase_ = Phase::kUp;
  std::uint32_t round_ = 0;
  std::map<RobotId, UpMessage> ups_;  // messages of the children in this round
  Eigen::Index sent_rows_ = 0;        // rows of the message up in this round
  std::optional<DownMessage> down_;
  std::vector<SE3> accepted_;  // own poses
  std::vector<SE3> base_;      // accepted followed poses
  std::vector<SE3> present_;   // followed poses after the step
  Eigen::MatrixXd step_;       // step of the followed poses
  TreeVerdict verdict_;        // last decision of the root
  bool refresh_ = true;
  SolverState state_;
  std::optional<TreeRoot> root_;
  bool factorised_ = true;
  bool noise_known_ = false;  // weigh_by_noise() has been called
  std::map<RobotId, TreeInverse> inverse_of_child_;
  std::vector<Matrix6> covariances_;
};

}  // namespace km
