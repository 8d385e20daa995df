#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "modules/pose_graph/frame_alignment.hpp"
#include "modules/pose_graph/letter_book.hpp"
#include "modules/pose_graph/member_solver.hpp"
#include "modules/pose_graph/session_graph.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// Makes one robot's solver of a session. It also sees to the session's max_rounds.
using MemberSolverFactory = std::function<std::unique_ptr<MemberSolver>(
    const Session& session, SessionGraph graph, TreePlace place)>;

/// The newest poses that each of the other robots has told.
using ToldPoses = std::map<RobotId, MemberPoses>;

/// What a robot brings to a session, frozen when it joins.
struct FrozenPart {
  /// `start` is in the robot's present frame, `told` holds the poses of absent robots, and
  /// `step_precision` its own: the rest comes from the members.
  SessionGraph graph = {};
  TreePlace place = {};
  bool in_frame = false;  ///< `start` is in the frame of the session already.
  /// False closures are to be expected: they would bend the trajectory.
  bool suspicious = true;
  std::vector<KeyframeIndex> public_keyframes = {};  ///< Ascending, 0 first.
};

/// One robot's part in one session, from joining it to its end, in stages.
///
/// First the robot enters the frame: if it is in another one it waits for its neighbours before it
/// in the session's order and is aligned to them. Its public poses are rounded to single precision
/// and are ready to be told (stage 0). With those of all members its solver begins; letters go both
/// ways until it is done (stage 1), or fails (stage 2).
///
/// A session may be cut short at any time, and its members are not all in the same round then. So
/// the poses of the last rounds are kept, and the coordinator tells now and then which round all
/// have completed: a member goes back to that one. All that have heard it hold poses of one round.
/// Deterministic; not thread-safe.
class SessionPart {
 public:
  SessionPart(Session session, TeamPeer self, FrozenPart part, MemberSolverFactory factory,
              const AlignmentTolerance& tolerance, double period_s, double now_s);

  /// One piece of work if there is any: the letters to be sent.
  [[nodiscard]] std::vector<SessionLetter> advance(const ToldPoses& told, double now_s);
  /// True if the last advance() has changed anything: there may be more to do.
  [[nodiscard]] bool worked() const { return worked_; }

  /// A letter of a member. Its sender is told once the solver has taken it: what comes before there
  /// is one is kept as far as there is room, and comes again. False if it is from no member, or of
  /// no use to the solver as things stand.
  bool receive(const SessionLetter& letter, double now_s);
  /// Senders of letters that were kept until there was a solver, and were of no use to it; empty
  /// thereafter.
  [[nodiscard]] std::vector<RobotId> take_refused() { return std::exchange(refused_, {}); }
  void reachable_again(RobotId robot) { letters_.reachable_again(robot); }

  /// What the coordinator says by now. True if that ends the session.
  bool follow(const Session& session);
  /// A round that all members have completed.
  void commit(std::uint32_t round);

  /// nullopt before the robot is in the frame; then 0, 1 with the solution, 2 if it has failed.
  [[nodiscard]] std::optional<std::uint32_t> stage() const { return stage_; }
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// Poses that a member of this session has told in it; nullptr if it has not, or not that far.
  [[nodiscard]] const MemberPoses* told_by(const ToldPoses& told, RobotId robot,
                                           std::uint32_t stage) const;
  /// True if all members, this one included, have told poses of stage 1.
  [[nodiscard]] bool all_solved(const ToldPoses& told) const;
  /// True if that is a closure between this robot and another member.
  [[nodiscard]] bool joins_members(const ClosureId& closure) const;

  [[nodiscard]] Session& session() { return session_; }
  [[nodiscard]] const Session& session() const { return session_; }
  [[nodiscard]] const std::vector<KeyframeIndex>& public_keyframes() const { return public_; }
  [[nodiscard]] const std::vector<RobotId>& members() const { return place_.members; }
  /// Of the solver; zeros before there is one.
  [[nodiscard]] SolverState state() const { return solver_ ? solver_->state() : SolverState(); }
  /// On closures to other members what the robot knew when it joined, and once there is a solver,
  /// on all closures that this robot weighs what the solver makes of them.
  [[nodiscard]] ClosureVerdicts verdicts() const;
  [[nodiscard]] ClosureNoiseRecord noise() const {
    return solver_ ? solver_->noise() : graph_.noise;
  }
  /// The best ones, in the frame of the session once there is a stage.
  [[nodiscard]] const std::vector<SE3>& poses() const;
  /// Those of the round that all members have completed, as far as is known.
  [[nodiscard]] const std::vector<SE3>& committed_poses() const { return committed_; }
  /// When something of the session was last done here or heard [s].
  [[nodiscard]] double moved_s() const { return moved_s_; }
  void moved(double now_s) { moved_s_ = now_s; }

 private:
  [[nodiscard]] bool enter(const ToldPoses& told);
  [[nodiscard]] bool align(const ToldPoses& told);
  [[nodiscard]] bool gather(const ToldPoses& told);
  void combine_decisions(const MemberPoses& told);
  void start_solver(double now_s);
  [[nodiscard]] bool hand_over(const SessionLetter& letter, double now_s);
  void keep(const SessionLetter& letter);
  void solve(double now_s);
  void fail(const std::string& why);
  void remember_round();

  Session session_;
  TeamPeer self_;
  SessionGraph graph_;  // moved to the solver
  TreePlace place_;
  bool in_frame_;
  bool suspicious_;
  std::vector<KeyframeIndex> public_;
  std::vector<ClosureId> between_;  // to other members, ascending
  MemberSolverFactory factory_;
  AlignmentTolerance tolerance_;
  std::map<RobotId, std::uint64_t> boot_of_;  // members
  LetterBook letters_;
  std::map<std::pair<RobotId, std::uint32_t>, SessionLetter> early_;  // before there is a solver
  std::size_t early_bytes_ = 0;
  std::vector<RobotId> refused_;  // senders of those it had no use for
  std::vector<SessionLetter> to_send_;
  std::unique_ptr<MemberSolver> solver_;
  std::optional<std::uint32_t> stage_;
  std::string failure_;
  std::deque<std::pair<std::uint32_t, std::vector<SE3>>> rounds_;  // the last ones
  std::vector<SE3> committed_;
  bool worked_ = false;
  double moved_s_;
};

}  // namespace km
