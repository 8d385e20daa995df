#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "modules/core/closure_verdicts.hpp"
#include "modules/pose_graph/own_graph.hpp"
#include "modules/pose_graph/pose_graph_config.hpp"
#include "modules/pose_graph/relay.hpp"
#include "modules/pose_graph/session_part.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// What a step of the agent gives to the others and to its own robot.
struct [[nodiscard]] TeamOutput {
  std::vector<Parcel> parcels = {};
  std::optional<Trajectory> trajectory = {};
  std::optional<OptimizerProgress> progress = {};
  std::optional<ClosureVerdicts> verdicts = {};  ///< On closures of this robot, after a session.
  std::vector<std::string> notices = {};         ///< What a person should know.
  bool more = false;  ///< The next step has work already, without further input.
};

/// One robot's part of the team's pose graph optimisation, as a state machine without threads and
/// clocks.
///
/// A robot's team is whoever links lead to, over others in between: see Relay. Those of it that
/// share inlier closures, directly or through others, optimise together in sessions. A session
/// freezes the graph: its members, and for every pair of them the edge set that both hold. The
/// member with the lowest id coordinates it: opens it when the graph has changed, and ends it. A
/// robot without partners coordinates its own. How a member gets through a session is in
/// SessionPart; the solver of its graph comes from a factory.
///
/// A session is not left for new measurements: the next one waits until its bytes are paid for and
/// it is worth its own. It is cut short when no links lead to a member any more: links that come
/// back at once (see Relay) spoil nothing, since letters are repeated and find other ways. Its
/// members go back to the last round that all have completed, and the next session begins there.
///
/// A robot that is out of reach leaves its last public poses behind, to be held fixed by the
/// others, so that they keep their frame and what it told them. When it comes back it catches up;
/// of another process what it told is forgotten, of another life also what was measured. What has
/// been decided about closures carries over from session to session, and so does what they tell of
/// their noise; both ends of a closure tell each other first. What a robot decides alone holds
/// until it is in a team, which knows the noise better; what a team decides beside the poses of
/// robots that have gone, until its next session: it may be those poses that are wrong. Where
/// closures were set aside unheard, those that fit the solution all the same are taken for
/// undecided again, and one more session weighs them.
///
/// Where all members know which way is up, that is part of what they minimise, and `world` has z
/// up.
/// Deterministic: equal inputs in equal order give equal outputs. Not thread-safe.
class TeamAgent {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  TeamAgent(const PoseGraphConfig& config, TeamPeer self, MemberSolverFactory factory);

  /// Own measurements and decisions about them; see OwnGraph for what is ignored. False if nothing
  /// has changed. What should not have come is counted in refused().
  bool add(const KeyframeOdometry& keyframe);
  bool add(const Closure& closure);
  bool add(const InlierSet& set);

  /// A robot is heard directly from now on, or no more.
  void peer_alive(TeamPeer peer);
  void peer_lost(RobotId robot);

  /// The keyframes of `peer` are others from now on: what was measured before counts no more.
  void peer_restarted(const TeamPeer& peer);

  /// A message that `from`, which is heard directly, has handed over; in any order, repeated or
  /// lost. False if it is refused.
  bool receive(RobotId from, const TeamMessagePtr& message);

  /// Does what is due, at most one piece of a solver's work. Call it after every input and, for
  /// repetitions, several times in a second; `now_s` [s] must not decrease.
  TeamOutput step(double now_s);

  /// Own poses at present, in the frame().
  [[nodiscard]] const std::vector<SE3>& poses() const;
  [[nodiscard]] const TeamFrame& frame() const { return frame_; }
  /// The session that this robot is in, or was in last.
  [[nodiscard]] const SessionPart* part() const { return part_ ? &*part_ : nullptr; }
  /// False if that session is at its end.
  [[nodiscard]] bool in_session() const { return part_ && !over_; }
  [[nodiscard]] const std::map<ClosureId, bool>& decided() const { return decided_; }
  [[nodiscard]] const Relay& relay() const { return relay_; }
  /// What was refused, and how often.
  [[nodiscard]] const std::map<std::string, std::size_t>& refused() const { return refused_; }

 private:
  struct Peer {
    std::uint64_t boot = 0;
    std::optional<TeamStatus> status = {};
    std::optional<Session> session = {};  // the newest that it coordinates
    std::uint32_t joined = 0;             // number of the last of these that this robot was in
    std::uint32_t missed = 0;             // of the last one that it could not join
    bool other_method = false;            // nothing will come of its edges
  };
  struct World {
    RobotId anchor = 0;
    SE3 T_frame_world = SE3::Identity();
  };

  // Who is there.
  Peer& meet(const TeamPeer& peer);
  void forget_measured(RobotId robot);
  void watch_links();
  [[nodiscard]] bool in_reach(const TeamPeer& peer) const;
  bool take(const TeamPeer& sender, const TeamStatus& status);
  bool take(const TeamPeer& sender, const Session& session);
  bool take(const TeamPeer& sender, const MemberPoses& poses);
  bool take(const TeamPeer& sender, const SessionLetter& letter);
  bool refuse(const std::string& what);
  [[nodiscard]] TeamStatus make_status() const;
  [[nodiscard]] std::uint32_t revision() const { return graph_.revision() + reconsidered_; }
  void send_status(TeamOutput& output);
  void hand_out(TeamOutput& output);

  // Who optimises what, and who says so.
  void make_plan();
  void coordinate();
  [[nodiscard]] bool all_upright(const SessionPlan& plan) const;
  [[nodiscard]] bool has_moved_on() const;
  [[nodiscard]] bool should_open() const;
  [[nodiscard]] std::uint64_t price_bytes() const;
  [[nodiscard]] bool paid_for() const;
  [[nodiscard]] bool worthwhile() const;
  void open_session();
  void announce();
  [[nodiscard]] bool well_formed(const Session& session) const;
  [[nodiscard]] bool accepts(const Session& session) const;
  void consider(const Session& session);

  // The session that this robot is in.
  void judge_odometry();
  void notice_closure_noise();
  bool join(const Session& session);
  [[nodiscard]] std::optional<FrozenPart> freeze(const Session& session) const;
  void extend_poses();
  [[nodiscard]] std::vector<PoseEdge> likely_closures(std::span<const PoseEdge> inside) const;
  void try_chordal(const Session& session);
  void advance(TeamOutput& output);
  void enter_stage(TeamOutput& output);
  void tell_poses();
  void conclude();
  void leave(bool with_solution);
  [[nodiscard]] bool misses_member(const SessionPlan& plan) const;
  [[nodiscard]] bool has_failed() const;
  void decide(const std::vector<WeighedClosure>& verdicts);
  void decide_with(const MemberPoses& poses);
  void decide_anew();
  void reconsider();
  [[nodiscard]] bool fits(const PoseEdge& closure) const;

  // Results.
  [[nodiscard]] std::optional<SE3> world_of(RobotId anchor) const;
  void publish(TeamOutput& output);
  [[nodiscard]] OptimizerProgress make_progress() const;
  [[nodiscard]] bool holds_all(const SessionPlan& plan) const;

  PoseGraphConfig config_;
  TeamPeer self_;
  MemberSolverFactory factory_;
  OwnGraph graph_;
  Relay relay_;
  std::map<RobotId, Peer> peers_;
  ToldPoses told_;  // the newest, of this robot, too
  std::map<ClosureId, bool> decided_;
  std::map<ClosureId, int> chances_;  // that rejected closures have had
  bool reconsider_due_ = false;       // once all have told the solution
  std::uint32_t reconsidered_ = 0;    // so many times there was something to weigh again
  ClosureNoiseRecord noise_;          // of the closures that are decided
  std::set<ClosureId> provisional_;   // decided without robots that are known of
  ClosureNoiseRecord team_noise_;     // without these

  std::uint64_t links_seen_ = 0;
  std::set<RobotId> component_;  // links lead there

  SessionPlan plan_;  // of what is known
  bool plan_outdated_ = true;
  double plan_changed_s_ = -1e9;      // its graph
  std::uint64_t closures_known_ = 0;  // by the robots of the plan
  std::uint64_t closures_used_ = 0;   // when the last session was opened
  std::uint32_t sessions_opened_ = 0;

  TeamFrame frame_;
  std::uint32_t frame_version_ = 0;
  std::vector<SE3> poses_;  // T_frame_kf, of the last session and odometry since
  std::optional<SessionPart> part_;
  bool over_ = true;       // nothing more comes of it
  bool deserted_ = false;  // a member of it has gone on to another one
  bool solved_ = false;    // and all members have its solution
  double started_s_ = 0.0;
  std::uint64_t sent_bytes_ = 0;                // for it, to every reader, and passed on
  std::map<ClosureId, bool> verdicts_;          // of that session
  double odometry_noticed_ = 0.0;               // largest noise scale of odometry in a notice
  std::map<RobotId, double> closures_noticed_;  // noise factor in the last notice, by peer
  std::optional<World> world_;                  // in frame_
  std::size_t chordal_tried_ = 0;               // with so many closures inside this robot

  std::optional<TeamStatus> sent_status_;
  std::map<std::string, std::size_t> refused_;
  std::vector<std::string> notices_;
  std::optional<ClosureVerdicts> verdicts_due_;
  bool publish_due_ = false;
  std::uint32_t rounds_before_ = 0;  // of earlier sessions
  double optimising_s_ = 0.0;        // in earlier sessions
  double now_s_ = 0.0;
  double status_sent_s_ = -1e9;
  double session_sent_s_ = -1e9;
  double published_s_ = -1e9;
};

}  // namespace km
