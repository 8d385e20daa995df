#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <variant>
#include <vector>

#include "modules/pose_graph/newton/newton_agent.hpp"
#include "modules/pose_graph/robust/gnc_edges.hpp"
#include "modules/pose_graph/robust/gnc_messages.hpp"
#include "modules/pose_graph/robust/gnc_schedule.hpp"

namespace km {

struct GncAgentOptions {
  GncOptions gnc;
  /// Steps of odometry inside a robot can be rejected, too; else all odometry is trusted.
  bool reject_odometry = false;
  /// The weighted problem between two updates is left once a step promises less decrease than this,
  /// relative to its cost; the last one is solved as NewtonOptions has it.
  double tolerance = 1e-3;
};

/// One robot's part in distributed graduated non-convexity over NewtonAgent (after Tian et al.,
/// "Kimera-Multi", TRO 2022: weights and poses in turn, warm-started). For every update each robot
/// tells its public poses; of an edge between two, the one with the lower id measures the residual
/// and tells it; from all residuals everyone runs the same GncSchedule, so both ends have the same
/// weight. That is two exchanges; then the weighted problem is solved by the team.
///
/// Starts from the chordal initialisation with all edges, found by the team itself, unless poses
/// are given: closer to the solution with all edges is not closer to the one without the outliers.
/// Not thread-safe.
class GncAgent {
 public:
  using Message = std::variant<GncPoses, GncResiduals, NewtonShare>;

  /// As for NewtonAgent. Throws std::invalid_argument if flags and edges differ in number.
  GncAgent(GncEdges edges, std::set<RobotId> team, int dimension, const GncAgentOptions& options,
           std::vector<SE3> start = {});

  /// What to send first.
  [[nodiscard]] NewtonHello hello() const;
  /// Messages of peers, and one's own, in any order; repeated and late ones change nothing.
  void receive(const NewtonHello& hello);
  void receive(const GncPoses& poses);
  void receive(const GncResiduals& residuals);
  void receive(std::shared_ptr<const NewtonShare> share);

  /// True if advance() has something to do.
  [[nodiscard]] bool ready() const;
  /// What to send next. Throws std::invalid_argument if the two ends of a robot pair do not have
  /// the same edges, and as NewtonAgent::advance().
  [[nodiscard]] std::optional<Message> advance();
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }

  /// Poses after the last weighted problem; empty before there are.
  [[nodiscard]] const std::vector<SE3>& poses() const { return poses_; }
  /// nullopt before the first update.
  [[nodiscard]] const std::optional<GncSchedule>& schedule() const { return schedule_; }
  /// Whether an edge of this robot, or to a peer, is an inlier; trusted ones are.
  [[nodiscard]] bool kept_own(std::size_t edge) const;
  [[nodiscard]] bool kept(RobotId peer, std::size_t edge) const;

 private:
  enum class Phase { kHello, kSolve, kPoses, kResiduals, kDone };
  /// Of another robot: what it decides.
  struct Decider {
    std::size_t first = 0;    ///< Of its candidates, in the schedule.
    std::size_t between = 0;  ///< How many of them are to other robots.
  };

  [[nodiscard]] bool may_be_rejected(bool odometry) const;
  [[nodiscard]] const SE3& told_pose(RobotId robot, KeyframeIndex pose) const;
  [[nodiscard]] std::size_t index_of(RobotId robot) const;
  [[nodiscard]] std::optional<std::size_t> own_candidate(std::size_t edge) const;
  [[nodiscard]] std::optional<std::size_t> candidate(RobotId peer, std::size_t edge) const;
  [[nodiscard]] GncPoses public_poses() const;
  [[nodiscard]] GncResiduals residuals() const;
  void make_schedule();
  [[nodiscard]] RobotEdges weighted_edges() const;
  [[nodiscard]] NewtonHello weighted_hello(const NewtonHello& hello) const;
  std::optional<Message> start_solve();
  std::optional<Message> continue_solve(std::optional<NewtonShare> share);
  std::optional<Message> update();

  GncEdges edges_;
  std::set<RobotId> team_;
  int dimension_;
  GncAgentOptions options_;
  Phase phase_ = Phase::kHello;
  std::uint32_t update_ = 0;
  std::vector<SE3> poses_;
  std::map<RobotId, NewtonHello> hellos_;
  std::map<std::uint32_t, std::map<RobotId, GncPoses>> public_poses_;  // by update
  std::map<std::uint32_t, std::map<RobotId, GncResiduals>> residuals_;
  std::vector<std::shared_ptr<const NewtonShare>> early_;  // of solves not begun yet
  std::optional<GncSchedule> schedule_;
  std::map<RobotId, Decider> deciders_;
  std::optional<NewtonAgent> solver_;
};

}  // namespace km
