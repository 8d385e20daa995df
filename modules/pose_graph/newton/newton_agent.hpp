#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "modules/pose_graph/newton/robot_system.hpp"
#include "modules/pose_graph/newton/separator_system.hpp"
#include "modules/pose_graph/newton/team_step.hpp"

namespace km {

struct NewtonOptions {
  double tolerance = 1e-13;  ///< Ends when a step promises less decrease, relative to the cost.
  double absolute_tolerance = 0.0;  ///< Or less than this: where nothing contradicts the cost is 0.
  /// Second derivatives are computed anew, which costs an elimination and its bytes, when at the
  /// rate seen with the old ones more rounds than this would still be needed.
  double patience_rounds = 8.0;
  int max_backtracks = 12;  ///< In a row, each to a quarter of the step.
  /// Some robot of the team has vertical priors, and the frame of the start has z up: the team's
  /// tilt is found, not held. All robots must say the same.
  bool upright = false;
  std::uint32_t first_round = 0;  ///< Number of the first exchange: tells solves in a row apart.
};

/// One robot's part in a distributed Newton method for pose graphs.
///
/// Separators, poses of which every edge between robots has one (see RobotGraph), cut the team's
/// graph into parts that touch one robot's other poses each. In every round a robot linearises its
/// edges at the present poses, eliminates its poses but the separators from Newton's equations, and
/// broadcasts what remains: right-hand side and Schur complement on the separators, its edges
/// between separators as such (see KeptEdge), and its share of the cost. From all robots' shares
/// everyone solves the same system and substitutes back into its own poses. So one exchange makes
/// one Newton step of the whole team, exact but for single precision in second derivatives, and no
/// pose but public ones is ever told.
///
/// Second derivatives hardly change (see edge_model.hpp): they are eliminated, and sent, only when
/// the old ones slow down convergence (Shamanskii's variant of Newton's method). The first ones are
/// Gauss-Newton's, which cannot be indefinite; so are those of a robot, or of the team, where the
/// full ones turn out to be. A step counts once all have told their cost there: if that has risen,
/// everyone goes back and takes a quarter of it. All decisions are made from the same numbers, so
/// all robots make the same ones without a coordinator.
///
/// Without start poses, two more rounds find the chordal initialisation with the same separators.
/// Not thread-safe.
class NewtonAgent {
 public:
  /// `team` are all robots, this one included; `dimension` 2: poses and measurements are planar.
  /// `start` has this robot's poses in the frame of the team, or is empty, for all robots alike.
  /// Throws std::invalid_argument if it has another number of poses, or if there is none although
  /// the team is to be upright.
  NewtonAgent(RobotEdges edges, std::set<RobotId> team, int dimension, const NewtonOptions& options,
              std::vector<SE3> start = {});

  /// What to send first.
  [[nodiscard]] NewtonHello hello() const;
  /// Messages of peers, and one's own, in any order; repeated and late ones change nothing.
  void receive(const NewtonHello& hello);
  void receive(std::shared_ptr<const NewtonShare> share);

  /// What to send next, once the last round is complete; nullopt if it is not, or if this robot
  /// is done. Throws std::invalid_argument where the team's graph is refused (see RobotGraph), and
  /// std::runtime_error if it is not connected.
  [[nodiscard]] std::optional<NewtonShare> advance();
  /// True if advance() has something to do.
  [[nodiscard]] bool ready() const;

  /// A robot is gone: the solve ends at the poses that hold so far.
  void leave(RobotId robot);
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }

  /// Poses of this robot with the lowest cost that the team has agreed on; empty before there are.
  [[nodiscard]] const std::vector<SE3>& poses() const { return accepted_; }
  /// Team cost there; nullopt before it is known.
  [[nodiscard]] std::optional<double> cost() const { return cost_; }
  /// g^T H^-1 g at the last poses that a step was found from: twice the decrease it promised.
  [[nodiscard]] double decrement() const { return decrement_; }

 private:
  enum class Phase { kHello, kRotations, kTranslations, kDescent, kDone };
  enum class Elimination { kReuse, kGaussNewton, kFull };

  void meet();
  void learn_separators();
  [[nodiscard]] SE3 told_pose(const KeyframeId& id) const;
  [[nodiscard]] bool is_public(const KeyframeId& id) const;
  NewtonShare share_of(const RobotSystem& system, bool with_schur);
  NewtonShare newton_share(Elimination elimination);
  NewtonShare with_kept_edges(const RobotSystem& system, Curvature curvature);
  NewtonShare rotation_share();
  NewtonShare set_rotations();
  NewtonShare set_translations();
  std::optional<NewtonShare> descend();
  std::optional<NewtonShare> go_back();
  [[nodiscard]] Eigen::MatrixXd substitute_back(const Eigen::MatrixXd& separators) const;
  [[nodiscard]] TeamStep make_step(const Eigen::MatrixXd& separators) const;
  void take_step(double scale);
  [[nodiscard]] bool worth_refreshing(double decrement);
  void factorise_own(const RobotSystem& system);
  void factorise_separators();

  RobotEdges edges_;
  std::set<RobotId> team_;
  int dimension_;
  NewtonOptions options_;
  Phase phase_ = Phase::kHello;
  std::uint32_t round_ = 0;
  std::map<RobotId, NewtonHello> hellos_;
  std::map<std::uint32_t, NewtonShares> shares_;  // of this round and later ones

  std::optional<RobotGraph> graph_;
  std::optional<FrontalCholesky> factor_;
  SeparatorSystem separator_system_;
  std::vector<int> place_of_kept_;  // among the separators
  std::vector<Eigen::Index> public_separators_;
  Eigen::MatrixXd forwarded_;  // of the last share: the eliminated right-hand side
  bool pattern_sent_ = false;

  std::vector<SE3> nodes_;            // candidate: own poses, then other robots' separators
  std::vector<SE3> separator_poses_;  // candidate, of the public ones
  std::vector<SE3> base_nodes_;       // where the last step began
  std::vector<SE3> base_separators_;
  TeamStep step_;
  std::vector<SE3> accepted_;
  std::optional<double> cost_;
  double decrement_ = 0.0;
  int backtracks_ = 0;  // in a row
  // Of the present second derivatives:
  bool all_gauss_newton_ = true;          // on all robots
  bool stale_ = false;                    // an accepted step has been taken since
  std::optional<double> last_decrement_;  // found with them
};

}  // namespace km
