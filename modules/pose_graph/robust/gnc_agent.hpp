#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "modules/pose_graph/newton/team_step.hpp"
#include "modules/pose_graph/robust/gnc_block.hpp"
#include "modules/pose_graph/robust/gnc_edges.hpp"
#include "modules/pose_graph/robust/gnc_messages.hpp"
#include "modules/pose_graph/robust/gnc_schedule.hpp"
#include "modules/pose_graph/robust/public_system.hpp"

namespace km {

struct GncAgentOptions {
  GncOptions gnc;
  /// Steps of odometry inside a robot can be rejected, too; else all odometry is trusted.
  bool reject_odometry = false;
  /// When all is decided, the end comes once a step promises less decrease, relative to the cost.
  double tolerance = 1e-13;
};

/// One robot's part in distributed graduated non-convexity: weights and poses in turn, as in Yang
/// et al., RA-L 2020, and distributed first in Tian et al., "Kimera-Multi", TRO 2022, but with one
/// exact Newton step of the whole team between two updates of the weights.
///
/// At first every robot tells its public poses and its edges to others, which its peers' trust in
/// those edges depends on. From then on everyone can weigh and linearise these edges himself, and
/// has to hear of the other robots only what their own parts come to, eliminated onto their public
/// poses: in every round a right-hand side, and second derivatives where its own closures' weights
/// have changed much. All solve the same system, take their own part of the same step, and run the
/// same GncSchedule on the same residuals. So an exchange of six numbers a public pose makes a
/// Newton step and an update of all weights. A step that makes the weighted cost rise is shortened,
/// then taken anew with fresh second derivatives. Not thread-safe.
class GncAgent {
 public:
  /// `team` are all robots, this one included; `dimension` 2: poses and measurements are planar.
  /// `start` has this robot's poses, in the frame of the team if `common_frame`; empty: odometry.
  /// Frames that are not in common are found from the edges between robots, see align_starts().
  /// Throws std::invalid_argument if flags and edges or poses differ in number, if an edge cannot
  /// be used, or if there is no start and the edges inside do not reach all poses.
  GncAgent(GncEdges edges, std::set<RobotId> team, int dimension, const GncAgentOptions& options,
           std::vector<SE3> start = {}, bool common_frame = true);

  /// What to send first.
  [[nodiscard]] GncHello hello() const;
  /// Messages of peers, and one's own, in any order; repeated and late ones change nothing.
  void receive(const GncHello& hello);
  void receive(std::shared_ptr<const GncShare> share);

  /// True if advance() has something to do.
  [[nodiscard]] bool ready() const;
  /// What to send next. Throws std::invalid_argument where what was told does not fit together, and
  /// std::runtime_error if the team is not connected.
  [[nodiscard]] std::optional<GncShare> advance();
  /// A robot is gone: it ends at the poses and weights that hold so far.
  void leave(RobotId robot);
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }

  /// Where the team has agreed on; before it has met, where this robot starts, in its own frame.
  [[nodiscard]] const std::vector<SE3>& poses() const { return base_.own; }
  /// Of the team's edges at poses(), with the weights that led there; 0 before the first step.
  [[nodiscard]] double cost() const { return cost_; }
  /// g^T H^-1 g of the last step.
  [[nodiscard]] double decrement() const { return decrement_; }
  [[nodiscard]] const GncEdges& edges() const { return edges_; }
  /// nullopt before the team has met.
  [[nodiscard]] const std::optional<GncSchedule>& schedule() const { return schedule_; }
  /// Whether an edge of this robot, or to a peer, is an inlier; trusted ones are.
  [[nodiscard]] bool kept_own(std::size_t edge) const;
  [[nodiscard]] bool kept(RobotId peer, std::size_t edge) const;

 private:
  enum class Phase { kHello, kRounds, kDone };
  struct Poses {
    std::vector<SE3> own;
    std::vector<SE3> all_public;
  };

  void meet();
  void make_schedule();
  void update_weights(const std::vector<float>& inside);
  [[nodiscard]] std::vector<float> inside_residuals(const std::vector<SE3>& own) const;
  [[nodiscard]] double told_cost(const Poses& poses) const;
  [[nodiscard]] GncShare share(bool fresh);
  [[nodiscard]] std::optional<GncShare> step_on();
  [[nodiscard]] std::optional<GncShare> go_back();
  [[nodiscard]] GncShare share_at_base();
  [[nodiscard]] bool worth_refreshing(double decrement, double cost);
  [[nodiscard]] std::optional<PublicSystem::Solution> solve();
  void take_step(double scale);

  GncEdges edges_;
  std::set<RobotId> team_;
  int dimension_;
  GncAgentOptions options_;
  bool common_frame_;
  GncBlock block_;
  std::vector<std::size_t> inside_;  // own edges that may be rejected: closures, then odometry
  std::size_t closures_ = 0;         // how many of them are closures
  Phase phase_ = Phase::kHello;
  std::uint32_t round_ = 0;
  std::map<RobotId, GncHello> hellos_;
  std::map<std::uint32_t, std::map<RobotId, std::shared_ptr<const GncShare>>> shares_;  // by round

  std::shared_ptr<const PublicGraph> graph_;
  std::optional<PublicSystem> system_;
  std::optional<GncSchedule> schedule_;
  std::vector<int> candidate_of_link_;  // in the schedule; -1: trusted
  std::size_t first_inside_ = 0;        // of this robot's candidates inside
  std::vector<double> link_weights_;

  Poses base_;  // what the team has agreed on
  double cost_ = 0.0;
  double decrement_ = 0.0;
  Poses candidate_;  // after the step at hand
  TeamStep step_;
  int backtracks_ = 0;                    // in a row
  bool at_base_ = true;                   // the candidate is the base: nothing to agree on
  bool hold_weights_ = false;             // for one step: the last one misled
  bool retried_ = false;                  // from this base, with fresh second derivatives
  int all_in_ = 0;                        // steps before the weights are first set
  bool decided_told_ = false;             // the last shares are of the weights decided
  bool full_told_ = false;                // and have full second derivatives
  bool convex_ = false;                   // those were indefinite: Gauss-Newton's until it is slow
  std::optional<double> last_decrement_;  // found with the present second derivatives
};

}  // namespace km
