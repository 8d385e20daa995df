#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "modules/pose_graph/local_graph.hpp"
#include "modules/pose_graph/pgo_messages.hpp"
#include "modules/pose_graph/pose_graph_config.hpp"
#include "modules/pose_graph/round_ledger.hpp"
#include "modules/pose_graph/session_block.hpp"
#include "modules/pose_graph/session_plan.hpp"
#include "modules/pose_graph/session_solver.hpp"

namespace km {

/// What a step of the agent gives to the others and to its own robot.
struct [[nodiscard]] PgoOutput {
  std::optional<PgoStatus> status;
  std::optional<PgoSession> session;
  std::optional<PublicPoses> poses;
  std::vector<SolverMessagePtr> exchange = {};
  std::optional<Trajectory> trajectory;
  std::optional<OptimizerProgress> progress;
  std::optional<ClosureVerdicts> verdicts;  ///< Of a solver that rejects, at its end.
  std::optional<std::string> notice;        ///< Something that a person should know.
  bool more = false;  ///< The next step has work already, without further input.
};

/// One robot's part of distributed pose graph optimisation, as a state machine without threads and
/// clocks.
///
/// Robots that share inlier closures, directly or through others, optimise together in sessions.
/// A session freezes the graph: members, and for every pair of them the edge set that both hold.
/// The present robot with the lowest id in the connected component coordinates it: opens a session
/// when the graph has changed, follows the team's cost, and ends it. A robot without partners
/// coordinates its own.
///
/// A session begins with round 0: members that are not in its frame yet are aligned to it, in the
/// session's order. Then it is solved by the method it was opened with:
///
/// - kRbcd, Riemannian block-coordinate descent (Tian et al., TRO 2021, Alg. 2 and 3). Members
///   update in turn without a central clock: a member updates its block in round t once it has the
///   poses of round t of all its neighbours before it in the session's order and of round t - 1 of
///   those after it. This is a Gauss-Seidel sweep: two neighbours never move at once, so no update
///   can raise the team's cost, whatever the delays (over-relaxed, see SessionBlock::update(), and
///   still never above the cost before); robots without common edges move at the same time. Public
///   poses are rounded to single precision by their sender, who goes on from the rounded ones: all
///   compute with the same numbers.
/// - kNewton and kGnc, by exchanges of a SessionSolver. Its poses are adopted when the whole team
/// has come
///   to the end; a session that is left before changes nothing, so its cost cannot have risen. It
///   is not left for new measurements, and the next one waits until its bytes are paid for and it
///   is worth its own. If the solver of any member gives up, all of them go on by kRbcd from where
///   the session began.
///
/// Where all members know which way is up, that is part of what kNewton and kRbcd minimise, and
/// `world` has z up. kGnc does without.
///
/// Closures that kGnc has rejected hold nothing to speak of in kRbcd until the next session of kGnc
/// weighs them anew: they keep a weight of kJointWeight, and so their ends stay public.
///
/// A robot that has gone leaves its last public poses behind as fixed neighbours, so that the
/// others keep their frame and what it told them; such sessions are kRbcd. One that returns with
/// another boot is forgotten.
/// Deterministic: equal inputs in equal order give equal outputs. Not thread-safe.
class PgoAgent {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  PgoAgent(const PoseGraphConfig& config, PgoPeer self);

  /// Own measurements and decisions about them; see LocalGraph for what is ignored.
  bool add(const KeyframeOdometry& keyframe);
  bool add(const Closure& closure);
  bool add(const InlierSet& set);

  void peer_alive(PgoPeer peer);
  void peer_lost(RobotId robot);

  /// Messages of peers, in any order, repeated or lost; status and poses also before peer_alive().
  /// False if one is refused: of another boot or configured method, infeasible, or inconsistent in
  /// itself.
  bool receive(const PgoStatus& status);
  bool receive(const PgoSession& session);
  bool receive(PublicPoses poses);
  bool receive(const SolverMessagePtr& message);

  /// Does what is due, at most one block update or exchange. Call it after every input and, for
  /// repetitions, several times in a second; `now_s` [s] must not decrease.
  PgoOutput step(double now_s);

  /// The present solution before rounding, r x 4n; nullptr before the first step with a keyframe.
  /// Blocks of members of one session, once past round 0, are in one frame.
  [[nodiscard]] const LiftedPoses* lifted_poses() const { return block_ ? &block_->X() : nullptr; }

 private:
  using LastTwo = std::array<SolverMessagePtr, 2>;  // by slot_of(); null before there are
  struct Peer {
    std::uint64_t boot = 0;
    bool alive = false;
    bool other_method = false;  // than configured here: nothing will come of its edges
    std::optional<PgoStatus> status = {};
    std::optional<PublicPoses> poses = {};  // the newest
    LastTwo exchange = {};
  };
  /// The part of this robot in a session that is solved by exchanges.
  struct Exchange {
    RobotEdges edges;  // frozen
    std::unique_ptr<SessionSolver> solver = {};
    Eigen::MatrixXd anchor = {};  // lifted pose that `solver` starts from as its origin
    std::uint32_t complete = 0;   // exchanges
    std::uint32_t sent = 0;       // messages
  };
  struct Running {
    PgoSession session;
    std::map<RobotId, std::size_t> position_of = {};
    std::optional<std::uint32_t> round = {};    // own; nullopt until the block is in the frame
    std::set<RobotId> counted = {};             // members before this one, and absent neighbours
    std::optional<Exchange> exchange = {};      // nullopt: kRbcd, or given up
    LastTwo last_sent = {};                     // of the exchange
    std::map<RobotId, std::size_t> bytes = {};  // sent for it, as far as heard, each once
    double started_s = 0.0;
    double moved_s = 0.0;  // last update
    double sent_s = 0.0;   // last update or repetition of its poses
  };
  using EdgesTo = std::map<RobotId, std::vector<InterEdge>>;

  // pgo_agent.cpp: peers, status, results.
  [[nodiscard]] const Peer* present(PgoPeer peer) const;
  [[nodiscard]] Peer* sender_of_message(PgoPeer peer);
  [[nodiscard]] PgoStatus make_status() const;
  void send_status(PgoOutput& output);
  [[nodiscard]] bool awaits_anchor() const;
  void publish(PgoOutput& output);
  [[nodiscard]] OptimizerProgress make_progress() const;
  [[nodiscard]] bool holds_all(const SessionPlan& plan) const;
  [[nodiscard]] std::optional<Eigen::MatrixXd> world_of(RobotId anchor) const;

  // pgo_session.cpp: who optimises what, and who says so.
  void coordinate(PgoOutput& output);
  void make_plan();
  [[nodiscard]] PgoMethod method_for(const SessionPlan& plan) const;
  [[nodiscard]] bool all_upright(const SessionPlan& plan) const;
  [[nodiscard]] bool should_open() const;
  [[nodiscard]] bool paid_for() const;
  [[nodiscard]] bool worthwhile() const;
  void open_session();
  [[nodiscard]] bool accepts(const PgoSession& session) const;
  void join_or_wait(const PgoSession& session);
  void follow(const PgoSession& session);

  // pgo_block.cpp: the block of this robot in a session, and its way into the frame.
  bool join(const PgoSession& session);
  [[nodiscard]] std::optional<EdgesTo> edges_in(const SessionPlan& plan) const;
  [[nodiscard]] EdgesTo edges_to_absent(const SessionPlan& plan) const;
  [[nodiscard]] std::vector<VerticalPrior> verticals_in(const PgoSession& session) const;
  [[nodiscard]] LiftedPoses extended_poses() const;
  void start_block(const PgoSession& session, EdgesTo edges, const EdgesTo& absent);
  void loosen_rejected(std::vector<BlockEdge>& own, EdgesTo& edges) const;
  void advance(PgoOutput& output);
  void align(PgoOutput& output);
  void enter_frame(PgoOutput& output);
  [[nodiscard]] const PublicPoses* poses_in_session(RobotId robot, std::uint32_t round) const;
  [[nodiscard]] bool hear_neighbours();
  [[nodiscard]] LiftedPoses rounded_public_poses() const;
  void send_poses(LiftedPoses rounded, double cost, double squared_gradient, PgoOutput& output);
  void repeat_if_silent(PgoOutput& output);

  // pgo_sweep.cpp: block-coordinate descent.
  void sweep(PgoOutput& output);
  [[nodiscard]] double relaxation_of(std::uint32_t round, std::size_t members) const;
  void count_share(const PublicPoses& poses);

  // pgo_exchange.cpp: a SessionSolver.
  void exchange(PgoOutput& output);
  [[nodiscard]] bool start_solver(PgoOutput& output);
  void take_in(const SolverMessagePtr& message) const;
  void advance_solver(PgoOutput& output);
  void send(SolverContent content, PgoOutput& output);
  void adopt_solution(PgoOutput& output);
  void take_verdicts(PgoOutput& output);
  void give_up(PgoOutput& output, const std::string& why);
  [[nodiscard]] std::optional<RobotId> one_that_gave_up() const;

  PoseGraphConfig config_;
  PgoPeer self_;
  LocalGraph graph_;
  std::map<RobotId, Peer> peers_;
  PgoFrame frame_;
  std::uint32_t frame_version_ = 0;
  std::optional<SessionBlock> block_;
  std::optional<Running> running_;
  std::optional<PgoSession> waiting_;  // to be joined when more is known
  std::optional<RoundLedger> ledger_;  // if this robot coordinates the running session
  SessionPlan plan_;                   // of what is known
  bool plan_outdated_ = true;
  double plan_changed_s_ = -1e9;      // its graph
  std::uint64_t closures_known_ = 0;  // by the robots of the plan
  std::uint64_t closures_used_ = 0;   // when the last session was opened
  std::uint32_t sessions_opened_ = 0;
  std::uint32_t total_rounds_ = 0;
  std::size_t intra_closures_tried_ = 0;
  std::set<ClosureId> rejected_;  // by kGnc
  std::optional<PublicPoses> sent_poses_;
  std::optional<PgoStatus> sent_status_;
  bool announce_session_ = false;
  bool publish_due_ = false;
  double now_s_ = 0.0;
  double status_sent_s_ = -1e9;
  double session_sent_s_ = -1e9;
  double published_s_ = -1e9;
  double optimising_s_ = 0.0;  // in sessions before the running one
};

}  // namespace km
