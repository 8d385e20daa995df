#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "modules/pose_graph/member_solver.hpp"
#include "modules/pose_graph/session_graph.hpp"
#include "modules/pose_graph/tree_front.hpp"
#include "modules/pose_graph/tree_letters.hpp"
#include "modules/pose_graph/tree_root.hpp"

namespace km {

/// One robot's part in a robust Newton method for the pose graph of a team, up and down a tree of
/// robots (see TreeFront).
///
/// A round is one way up and one way down. Up go the equations of the poses at hand, eliminated
/// onto what concerns others, and the sums of cost and residuals; the root solves, decides, and
/// down go the steps of the poses told: one round makes one Newton step of the whole team, exact
/// but for single precision in second derivatives. A step counts once the next way up has brought
/// the cost there: if it has risen, it is shortened; while weights change, the cost may rise by
/// half, twice in a row. All decisions are the root's.
///
/// Second derivatives hardly change (see edge_model.hpp): they are told anew only when the old ones
/// slow down convergence (Shamanskii's variant of Newton's method). The first ones are
/// Gauss-Newton's, which cannot be indefinite.
///
/// Every closure has a weight: graduated non-convexity with truncated least squares (Yang et al.,
/// RA-L 2020) sets the weights between two steps, and its end is the plain optimum of the closures
/// that are kept. Which residuals are too large the team finds out itself, from closures beside
/// each other (see Corroboration); where those agree, closures that stand alone are set aside at
/// first. Decisions of sessions before are kept; a pair of robots with new closures opens its own
/// again, but for the rejected ones. Edges to robots that have gone are weighed as they were.
///
/// A closure between two robots is weighed by one of them: an end of each closure is chosen to
/// stand for it (a vertex cover per pair, the same for both), and the robot of the other end has
/// the closure among its own edges, with the chosen pose told to it.
class TreeNewton final : public MemberSolver {
 public:
  /// Throws std::invalid_argument if an edge cannot be used or a public pose was not told.
  TreeNewton(SessionGraph graph, TreePlace place, const TreeNewtonOptions& options);

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool ready() const override;
  [[nodiscard]] std::vector<SolverLetter> advance() override;
  [[nodiscard]] bool done() const override { return phase_ == Phase::kDone; }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return accepted_; }
  [[nodiscard]] SolverState state() const override { return state_; }
  [[nodiscard]] ClosureVerdicts verdicts() const override;
  [[nodiscard]] ClosureNoiseRecord noise() const override { return graph_.noise; }

 private:
  enum class Phase { kUp, kDown, kDone };
  enum class Trust { kIn, kOpen, kOut };
  /// An edge that this robot knows; between robots it may be the other's to weigh.
  struct Known {
    PoseEdge edge;
    Trust trust = Trust::kIn;
    bool aside = false;  ///< Stands alone: out for this session.
    bool odometry = false;
    bool own = true;               ///< Among this robot's edges.
    double weight = 1.0;           ///< At the accepted poses.
    double candidate = 1.0;        ///< At those at hand.
    double limit = 1.0;            ///< Left of the weight while its pair is limited.
    double share = 1.0;            ///< Left of the weight at the accepted poses.
    double candidate_share = 1.0;  ///< At those at hand.
  };

  void classify();
  [[nodiscard]] bool takes_part(const Known& k) const { return k.trust != Trust::kOut && !k.aside; }
  [[nodiscard]] bool speaks_for(const Known& k) const;
  /// The other robot of the edge; itself, of an own one.
  [[nodiscard]] RobotId peer_of(const Known& k) const;
  [[nodiscard]] const SE3& start_of(const KeyframeId& id) const;
  [[nodiscard]] std::map<RobotId, std::vector<std::size_t>> by_peer() const;
  void weigh_by_noise();
  void find_isolated(double barc);
  [[nodiscard]] std::map<RobotId, double> shares_of_pairs() const;
  void build_front();
  void share_closures(std::map<KeyframeIndex, std::uint32_t>& touched_by);
  [[nodiscard]] const SE3& pose_at(const KeyframeId& id, const std::vector<SE3>& poses) const;
  [[nodiscard]] std::vector<double> front_weights(bool candidate) const;

  [[nodiscard]] UpLetter first_letter();
  void count_closures(TreeSums& sums) const;
  void move_robots(const std::vector<std::pair<RobotId, SinglePose>>& moves);
  [[nodiscard]] UpLetter equations();
  void weigh_candidates(TreeSums& sums);
  void limit_candidates(bool decided);
  [[nodiscard]] std::set<RobotId> torn_pairs() const;
  [[nodiscard]] std::vector<SolverLetter> go_up();
  [[nodiscard]] bool can_follow(const DownLetter& letter) const;
  [[nodiscard]] std::vector<SolverLetter> go_down(const DownLetter& letter);
  void take_step(const Eigen::VectorXd& step, const TreeVerdict& verdict,
                 std::map<RobotId, Eigen::VectorXd>& children);
  void accept();
  void finish();

  SessionGraph graph_;
  TreePlace place_;
  TreeNewtonOptions options_;
  std::vector<Known> known_;  // as SessionGraph::own, then ::between
  std::optional<TreeFront> front_;
  std::vector<std::size_t> front_edge_;  // which of known_ the front's edges are

  Phase phase_ = Phase::kUp;
  std::uint32_t round_ = 0;
  std::map<RobotId, UpLetter> ups_;  // of the children, in this round
  Eigen::Index told_rows_ = 0;       // of the letter up in this round
  std::optional<DownLetter> down_;
  std::vector<SE3> accepted_;  // own poses
  std::vector<SE3> base_;      // followed poses, accepted
  std::vector<SE3> at_hand_;   // followed poses
  Eigen::MatrixXd step_;       // of followed poses
  TreeVerdict told_;           // the last one
  bool refresh_ = true;
  SolverState state_;
  std::optional<TreeRoot> root_;
  bool factorised_ = true;
  bool noise_known_ = false;  // weigh_by_noise() has been called
};

}  // namespace km
