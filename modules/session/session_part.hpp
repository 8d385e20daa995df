#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "modules/robust/member_solver.hpp"
#include "modules/robust/session_graph.hpp"
#include "modules/session/own_graph.hpp"
#include "modules/session/reliable_channel.hpp"
#include "modules/session/session_state.hpp"
#include "modules/session/team_messages.hpp"

namespace km {

/// The contribution of a robot to a session, frozen when it joins.
struct FrozenPart {
  /// `public_poses` has the poses of absent robots only. `step_precision` and `later_runs` have
  /// the entry of this robot only. The other members of the session send theirs. The agent sets
  /// `start`, and the decisions on closures to absent robots.
  SessionGraph graph = {};
  TreePlace place = {};
  bool in_frame = false;  ///< `start` is already in the frame of the session.
  /// Closures may be false (pose_graph.robust with Newton's method). The trajectory is then not
  /// deformed to fit closures, and claimed precisions are limited.
  bool closures_may_be_false = true;
  std::vector<KeyframeIndex> public_keyframes = {};  ///< Ascending, 0 first.
};

/// The measurements of robot `self` in `session`, of which it is a member. `peers` are the robots
/// that it knows; closures to absent ones are tied to their poses in `results`. nullopt if `graph`
/// does not have the edges() by which the plan of the session names the closures of a pair.
[[nodiscard]] std::optional<FrozenPart> freeze_part(const Session& session, RobotId self,
                                                    const OwnGraph& graph,
                                                    std::span<const RobotId> peers,
                                                    const PublicPoses& results);

/// Creates the solver of one robot for a session, which also enforces max_rounds of the session.
using MemberSolverFactory = std::function<std::unique_ptr<MemberSolver>(
    const Session& session, SessionGraph graph, TreePlace place)>;

/// The part of one robot in the solution of a session.
struct SessionResult {
  SolverState state = {};
  ClosureVerdicts verdicts = {};  ///< On all closures that this robot weighs.
  ClosureNoiseRecord noise = {};
  std::vector<Matrix6> covariances = {};  ///< At `poses`; empty if the solver computes none.
  std::vector<SE3> poses = {};
  std::string failure = {};  ///< Why the session cannot be solved.
};

/// The outcome of a piece of work of a session.
struct [[nodiscard]] SessionWork {
  std::vector<ReliableMessage> messages = {};  ///< To send.
  bool any = false;                            ///< Something has changed; there may be more to do.
  std::vector<RobotId> refused = {};  ///< Senders of early messages that the solver then refused.
};

/// Time and bytes of a session at one robot.
struct SessionCost {
  double started_s = 0.0;
  double last_activity_s = 0.0;  ///< Time of the last work or message of the session.
  /// Bytes of all messages of the session that this robot has sent or forwarded. A message counts
  /// once for each neighbour that receives it.
  std::uint64_t sent_bytes = 0;
};

/// The part of one robot in one session, from joining it to its end: see SessionState.
///
/// First the robot enters the frame of the session. If it is in another frame, it waits for its
/// neighbours that precede it in the order of the session, and is aligned to them. Its public poses
/// are then rounded to single precision and ready to be sent. Once the public poses of all members
/// have arrived, its solver begins. Members exchange messages until the solver is done or fails.
///
/// If closures are left for a second look, it follows. All members send their poses and verdicts,
/// and another solver begins there: see MemberEdges. Deterministic; not thread-safe.
class SessionPart {
 public:
  SessionPart(Session session, TeamPeer self, FrozenPart part, MemberSolverFactory factory,
              double now_s);

  /// Does one piece of work, if there is any.
  SessionWork advance(const PublicPoses& published, double now_s);

  /// Processes a message of a member. It is acknowledged once the solver has taken it. Messages
  /// that arrive before there is a solver are kept if there is room. Otherwise the sender repeats
  /// them. False if the sender is not a member, or if the solver cannot use the message at present.
  bool receive(const ReliableMessage& message, double now_s);
  void reachable_again(RobotId robot) { channel_.reachable_again(robot); }

  /// Takes the newest message of the coordinator. True if it ends the session.
  bool follow(const Session& session);
  /// The session ends for this robot: all members have the solution, or it is interrupted.
  void end(bool completed) {
    take(completed ? SessionEvent::kCompleted : SessionEvent::kInterrupted);
  }

  [[nodiscard]] SessionState state() const { return state_; }
  [[nodiscard]] std::optional<MemberStage> stage() const { return stage_of(state_); }
  /// Poses that a member has sent in this session at `stage` or later; nullptr if there are none.
  [[nodiscard]] const MemberPoses* poses_of(const PublicPoses& published, RobotId robot,
                                            MemberStage stage) const;
  /// True if all members, including this one, have sent their part of the solution.
  [[nodiscard]] bool all_solved(const PublicPoses& published) const;
  /// True if `closure` is between this robot and another member.
  [[nodiscard]] bool joins_members(const ClosureId& closure) const;

  [[nodiscard]] Session& session() { return session_; }
  [[nodiscard]] const Session& session() const { return session_; }
  [[nodiscard]] const std::vector<KeyframeIndex>& public_keyframes() const { return public_; }
  /// The poses of public_keyframes() as other robots receive them. Before the stage kSolved they
  /// are the poses with which the solver of this robot begins, to the last bit.
  [[nodiscard]] std::vector<SinglePose> public_poses() const;
  [[nodiscard]] const std::vector<RobotId>& members() const { return place_.members; }
  /// Progress of the solver; zeros before there is one.
  [[nodiscard]] SolverState progress() const;
  /// That of the last solver that has finished.
  [[nodiscard]] const SessionResult& result() const { return result_; }
  [[nodiscard]] SessionCost& cost() { return cost_; }
  [[nodiscard]] const SessionCost& cost() const { return cost_; }

 private:
  void round_public_poses();
  [[nodiscard]] bool align(const PublicPoses& published);
  [[nodiscard]] bool gather(const PublicPoses& published);
  void take(SessionEvent event) { state_ = next_state(state_, event); }
  void start_solver(double now_s);
  void look_again();
  [[nodiscard]] bool pass_to_solver(const ReliableMessage& message, double now_s);
  void solve(double now_s);
  void fail(const std::string& why);

  Session session_;
  TeamPeer self_;
  SessionGraph graph_;
  TreePlace place_;
  bool in_frame_;
  bool closures_may_be_false_;
  std::vector<KeyframeIndex> public_;
  std::vector<SinglePose> entered_;  // poses of public_ with which the solver begins
  std::vector<ClosureId> between_;   // to other members, ascending
  MemberSolverFactory factory_;
  std::map<RobotId, std::uint64_t> boot_of_;  // members
  ReliableChannel channel_;
  std::map<std::pair<RobotId, std::uint32_t>, ReliableMessage> early_;  // before there is a solver
  std::size_t early_bytes_ = 0;
  SessionWork work_;  // since the last advance()
  std::unique_ptr<MemberSolver> solver_;
  SessionResult result_;
  SessionState state_ = SessionState::kEntering;
  SessionCost cost_;
};

}  // namespace km
