#pragma once

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/geometry/precision.hpp"
#include "modules/session/node/team_codec.hpp"
#include "modules/session/team_agent.hpp"
#include "runtime/overlay/overlay.hpp"
#include "runtime/overlay/overlay_codec.hpp"
#include "test/support/solver_team.hpp"

namespace km {

/// Difference, relative to the cost, up to which a team's solution is the optimum.
inline constexpr double kCostTolerance = 1e-6;

/// Covariance of a pose with these standard deviations about and along each axis.
[[nodiscard]] inline Matrix6 isotropic(double rotation_rad, double translation_m) {
  Matrix6 Sigma = Matrix6::Zero();
  Sigma.diagonal().head<3>().setConstant(rotation_rad * rotation_rad);
  Sigma.diagonal().tail<3>().setConstant(translation_m * translation_m);
  return Sigma;
}

/// The problem except for these closures.
[[nodiscard]] inline TeamProblem without(TeamProblem problem, const std::set<ClosureId>& closures) {
  std::erase_if(problem.edges, [&](const PoseEdge& e) { return closures.contains(e.id()); });
  return problem;
}

/// Properties of all links, the same in both directions.
struct NetworkLinks {
  double min_delay_s = 1e-3;
  double max_delay_s = 1e-3;  ///< Uniform: reorders if it is above the least.
  double lost = 0.0;          ///< Probability.
  double duplicated = 0.0;    ///< Probability of a second copy, with a delay of its own.
};

/// A message of the pose graph on its way over one link, to a robot that is received directly.
struct LinkPacket {
  RobotId next = 0;  ///< Robot at the other end of the link.
  std::shared_ptr<const TeamMessage> message = {};
  std::uint32_t number = 0;  ///< Its number in the overlay.
};

/// Agents of a team with their overlays, on a network in memory with virtual time, over any links,
/// which may fail and return. All messages cross it as bytes.
class TeamNetwork {
 public:
  struct Robot {
    TeamPeer peer = {};
    std::unique_ptr<Overlay> overlay = {};
    std::unique_ptr<TeamAgent> agent = {};
    bool dead = false;
    std::optional<Trajectory> trajectory = {};
    OptimizerProgress progress = {};
    ClosureVerdicts verdicts = {};
    std::vector<std::string> notices = {}, news = {};
    std::size_t bytes = 0;  ///< Sent, counted for every reader, including relayed and lost ones.
    std::size_t session_bytes = 0;  ///< The part of them that belongs to sessions.
    std::uint64_t links_version = 0;
    bool steps_now = true;
  };

  explicit TeamNetwork(unsigned seed = 1) : rng_(seed) {}

  NetworkLinks links = {};
  /// Time for which the ends of a failed link do not notice the failure: short gaps have no effect.
  double lease_s = 0.2;
  std::map<RobotId, Robot> robots = {};
  std::size_t undecodable = 0;  ///< Invalid messages that agents have sent.
  /// After every step of a robot.
  std::function<void(const Robot&)> on_step = {};
  /// Called with every message of the pose graph before it is sent.
  std::function<void(RobotId from, const LinkPacket&)> on_packet = {};

  TeamAgent& add(TeamPeer peer, const PoseGraphConfig& config, const MemberSolverFactory& factory) {
    Robot& robot = robots[peer.robot];
    robot = Robot{.peer = peer};
    robot.overlay = std::make_unique<Overlay>(peer);
    robot.agent = std::make_unique<TeamAgent>(config, peer, factory);
    for (auto& [id, other] : robots)
      if (id != peer.robot) renew(peer.robot, id);
    return *robot.agent;
  }

  void switch_link(RobotId a, RobotId b, bool up) {
    up_[std::minmax(a, b)] = up;
    renew(a, b);
  }
  /// Leaves only the links of `pairs`.
  void wire(const std::vector<std::pair<RobotId, RobotId>>& pairs) {
    for (const auto& [a, of_a] : robots)
      for (const auto& [b, of_b] : robots) {
        if (a >= b) continue;
        const bool up = std::any_of(pairs.begin(), pairs.end(), [&](const auto& pair) {
          return std::minmax(pair.first, pair.second) == std::minmax(a, b);
        });
        switch_link(a, b, up);
      }
  }

  /// Ends the process; messages in flight to it are lost. add() starts another process, revive()
  /// continues the same one.
  void kill(RobotId robot) {
    robots.at(robot).dead = true;
    std::erase_if(in_flight_, [&](const auto& entry) { return entry.second.to == robot; });
    for (const auto& [id, other] : robots)
      if (id != robot) renew(robot, id);
  }
  void revive(RobotId robot) {
    robots.at(robot).dead = false;
    for (const auto& [id, other] : robots)
      if (id != robot) renew(robot, id);
  }

  /// Calls `what` at time `at_s`.
  void at(double at_s, std::function<void()> what) { schedule_.emplace(at_s, std::move(what)); }

  [[nodiscard]] double now_s() const { return now_s_; }
  [[nodiscard]] TeamAgent& agent(RobotId robot) { return *robots.at(robot).agent; }

  /// Runs for `duration_s` of virtual time, or until `done`, which is asked after every step. True
  /// if it was.
  bool run(
      double duration_s, const std::function<bool()>& done = [] { return false; }) {
    const double end_s = now_s_ + duration_s;
    while (true) {
      double next_s = next_tick_s_;
      if (!in_flight_.empty()) next_s = std::min(next_s, in_flight_.begin()->first);
      if (!schedule_.empty()) next_s = std::min(next_s, schedule_.begin()->first);
      if (busy_) next_s = now_s_;
      if (next_s > end_s) break;
      now_s_ = std::max(now_s_, next_s);
      while (!schedule_.empty() && schedule_.begin()->first <= now_s_)
        schedule_.extract(schedule_.begin()).mapped()();
      deliver();
      const bool tick = now_s_ >= next_tick_s_;
      if (tick) next_tick_s_ = now_s_ + kTick_s;
      if (now_s_ >= next_status_s_) send_summaries();
      busy_ = false;
      for (auto& [id, robot] : robots)
        if (!robot.dead && (tick || robot.steps_now)) step(robot);
      if (done()) return true;
    }
    now_s_ = end_s;
    return false;
  }

  /// Delivers a message to `to` as if `from`, which has introduced its origin, had sent it over a
  /// link. By default it is newer than all messages of its kind.
  void inject(TeamPeer from, RobotId to, const TeamMessage& message,
              std::optional<std::uint32_t> number = {}) {
    OverlayMessage injected = overlay_message(message);
    const Decoded<TeamMessage> read = team_message(injected);
    if (number || is_state(injected.stream)) injected.number = number.value_or(++injected_);
    const auto introduction = std::make_shared<const OverlayMessage>(
        OverlayMessage{.origin = injected.origin, .content = {'r'}});
    Robot& robot = robots.at(to);
    if (injected.origin.robot != from.robot)
      (void)robot.overlay->receive(identity(from), introduction, now_s_);
    const OverlayArrival arrival = robot.overlay->receive(
        identity(from), std::make_shared<const OverlayMessage>(std::move(injected)), now_s_);
    OverlayOutput output = robot.overlay->take_output();
    output.delivered.clear();  // the message need not be one that can be decoded
    carry_out(robot, output);
    const auto* reliable = std::get_if<ReliableMessage>(&message);
    if (arrival == OverlayArrival::kNew && read.value &&
        (reliable == nullptr || reliable->to == to))
      (void)robot.agent->receive(*read.value);
    robot.steps_now = busy_ = true;
  }
  /// As if `to` received a robot directly that is not in the network, or no longer.
  void appear(RobotId to, TeamPeer peer) {
    robots.at(to).overlay->connected(identity(peer), now_s_);
    robots.at(to).agent->peer_alive(peer);
  }
  void disappear(RobotId to, RobotId robot) {
    robots.at(to).overlay->lost(robot, now_s_);
    robots.at(to).agent->peer_lost(robot);
  }

  /// True if all running robots are members of one settled session.
  [[nodiscard]] bool all_settled() const {
    std::vector<RobotId> running;
    for (const auto& [id, robot] : robots)
      if (!robot.dead) running.push_back(id);
    return std::ranges::all_of(running, [&](RobotId id) {
      const OptimizerProgress& progress = robots.at(id).progress;
      return progress.settled && progress.members == running;
    });
  }

  /// Published poses; they are in one frame if all have the same anchor.
  [[nodiscard]] TeamPoses trajectories() const {
    TeamPoses poses;
    for (const auto& [id, robot] : robots)
      if (robot.trajectory) poses[id] = robot.trajectory->T_world_kf;
    return poses;
  }

 private:
  static constexpr double kTick_s = 0.02;
  static constexpr double kSummary_s = 0.5;  // period of statuses
  struct Delivery {
    RobotId from = 0;
    RobotId to = 0;
    OverlayMessagePtr message = {};
    std::optional<OverlaySummary> summary = {};  // in place of a message
  };

  static RobotIdentity identity(const TeamPeer& peer) {
    return {.robot = peer.robot, .name = "r", .boot = peer.boot};
  }

  [[nodiscard]] bool connected(RobotId a, RobotId b) const {
    const auto at_a = robots.find(a), at_b = robots.find(b);
    const auto link = up_.find(std::minmax(a, b));
    return at_a != robots.end() && at_b != robots.end() && !at_a->second.dead &&
           !at_b->second.dead && (link == up_.end() || link->second);
  }

  // The ends of a link notice a change: at once if it returns, after the lease if it fails.
  void renew(RobotId a, RobotId b) {
    if (connected(a, b)) {
      report_alive(a, b);
      report_alive(b, a);
      return;
    }
    at(now_s_ + lease_s, [this, a, b] {
      if (connected(a, b)) return;
      report_lost(a, b);
      report_lost(b, a);
    });
  }
  void report_alive(RobotId to, RobotId of) {
    const TeamPeer& peer = robots.at(of).peer;
    std::optional<TeamPeer>& reported = reported_[{to, of}];
    if (reported == peer) return;
    reported = peer;
    appear(to, peer);
    robots.at(to).steps_now = busy_ = true;
  }
  void report_lost(RobotId to, RobotId of) {
    std::optional<TeamPeer>& reported = reported_[{to, of}];
    if (!reported) return;
    reported.reset();
    if (robots.contains(to)) disappear(to, of);
  }

  void step(Robot& robot) {
    robot.overlay->step(now_s_);
    carry_out(robot);
    TeamOutput output = robot.agent->step(now_s_, robot.session_bytes);
    robot.steps_now = output.more;
    busy_ |= output.more;
    if (output.trajectory) robot.trajectory = std::move(output.trajectory);
    if (output.progress) robot.progress = std::move(*output.progress);
    if (output.verdicts) robot.verdicts = std::move(*output.verdicts);
    for (auto [from, to] :
         {std::pair(&output.notices, &robot.notices), {&output.news, &robot.news}})
      std::ranges::move(*from, std::back_inserter(*to));
    for (const TeamMessage& message : output.messages) {
      OverlayMessage sent = overlay_message(message);
      if (is_state(sent.stream))
        robot.overlay->publish(sent.stream, std::move(sent.content), now_s_);
      else
        (void)robot.overlay->call(sent.stream, sent.to, sent.number, std::move(sent.content));
    }
    carry_out(robot);
    if (on_step) on_step(robot);
  }

  // Sends the packets of an overlay and delivers its messages to the agent.
  void carry_out(Robot& robot) { carry_out(robot, robot.overlay->take_output()); }
  void carry_out(Robot& robot, const OverlayOutput& output) {
    const KnownRobots& known = robot.overlay->robots();
    if (std::exchange(robot.links_version, known.links_version()) != known.links_version())
      robot.agent->update_links({known.links(), known.links_version()});
    for (const OverlayPacket& packet : output.packets) send(robot, packet);
    for (const OverlayMessagePtr& delivered : output.delivered) {
      const Decoded<TeamMessage> message = team_message(*delivered);
      if (message.value)
        (void)robot.agent->receive(*message.value);
      else
        ++undecodable;
    }
  }

  void send_summaries() {
    next_status_s_ = now_s_ + kSummary_s;
    for (auto& [id, robot] : robots) {
      if (robot.dead) continue;
      for (const auto& [neighbour, state] : robot.overlay->robots().neighbours())
        launch(robot, {id, neighbour, nullptr, robot.overlay->summary()});
    }
  }

  void send(Robot& from, const OverlayPacket& packet) {
    const OverlayStream stream = packet.message->stream;
    if (on_packet && stream > OverlayStream::kLinks) {
      const Decoded<TeamMessage> message = team_message(*packet.message);
      if (message.value)
        on_packet(from.peer.robot,
                  {packet.neighbour, std::make_shared<const TeamMessage>(*message.value),
                   packet.message->number});
    }
    const std::vector<std::uint8_t> bytes = encode(packet);
    const auto across = decode_overlay_packet(bytes, from.peer, lane_of(stream));
    if (!across.value) ++undecodable;
    from.bytes += bytes.size();
    if (stream > OverlayStream::kTeamStatus) from.session_bytes += bytes.size();
    launch(from, {from.peer.robot, packet.neighbour, across.value->message, {}});
  }

  void launch(const Robot& from, const Delivery& delivery) {
    if (!connected(from.peer.robot, delivery.to)) return;
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    if (uniform(rng_) < links.lost) return;
    const int copies = uniform(rng_) < links.duplicated ? 2 : 1;
    for (int copy = 0; copy < copies; ++copy) {
      const double delay_s =
          links.min_delay_s + (links.max_delay_s - links.min_delay_s) * uniform(rng_);
      in_flight_.emplace(now_s_ + delay_s, delivery);
    }
  }

  void deliver() {
    while (!in_flight_.empty() && in_flight_.begin()->first <= now_s_) {
      const Delivery delivery = in_flight_.extract(in_flight_.begin()).mapped();
      Robot& to = robots.at(delivery.to);
      if (!connected(delivery.from, delivery.to)) continue;
      if (delivery.summary)
        to.overlay->update(delivery.from, *delivery.summary, now_s_);
      else
        (void)to.overlay->receive(identity(robots.at(delivery.from).peer), delivery.message,
                                  now_s_);
      carry_out(to);
      to.steps_now = true;
    }
  }

  std::mt19937 rng_;
  std::map<std::pair<RobotId, RobotId>, bool> up_;  // by default true
  std::map<std::pair<RobotId, RobotId>, std::optional<TeamPeer>> reported_;
  std::multimap<double, Delivery> in_flight_;
  std::multimap<double, std::function<void()>> schedule_;
  std::uint32_t injected_ = 1'000'000;
  double now_s_ = 0.0;
  double next_tick_s_ = 0.0;
  double next_status_s_ = 0.0;
  bool busy_ = false;
};

/// The keyframe at the end of a step.
[[nodiscard]] inline KeyframeOdometry keyframe_after(const PoseEdge& step) {
  return {
      .id = step.to, .T_previous_kf = step.T_from_to, .covariance = covariance_of(step.precision)};
}

/// A closure; with `problem` its start is the odometry of both ends.
inline Closure closure_of(const PoseEdge& e, const TeamProblem* problem = nullptr) {
  Closure closure;
  closure.from.id = e.from;
  closure.to.id = e.to;
  if (problem != nullptr)
    for (OdometryPose* end : {&closure.from, &closure.to})
      end->T_odom_kf = problem->start.at(end->id.robot)[end->id.index];
  closure.T_from_to = e.T_from_to;
  closure.covariance = covariance_of(e.precision);
  return closure;
}

/// All closures between a and b in `problem`.
inline InlierSet inlier_set(const TeamProblem& problem, RobotId a, RobotId b,
                            std::uint32_t version = 1) {
  InlierSet set{std::min(a, b), std::max(a, b), version, {}};
  for (const PoseEdge& e : problem.edges)
    if (!is_step(e) && std::minmax(e.from.robot, e.to.robot) == std::minmax(a, b))
      set.closures.push_back(e.id());
  std::sort(set.closures.begin(), set.closures.end());
  return set;
}

/// Gives an agent the closures of its robot, all of them inliers.
inline void feed_closures(TeamAgent& agent, RobotId robot, const TeamProblem& problem,
                          std::uint32_t version = 1) {
  std::set<RobotId> others;
  for (const PoseEdge& e : problem.edges) {
    if (is_step(e) || (e.from.robot != robot && e.to.robot != robot)) continue;
    (void)agent.add(closure_of(e, &problem));
    others.insert(e.from.robot == robot ? e.to.robot : e.from.robot);
  }
  for (const RobotId other : others) (void)agent.add(inlier_set(problem, robot, other, version));
}

/// Gives an agent the odometry and the closures of its robot.
inline void feed(TeamAgent& agent, RobotId robot, const TeamProblem& problem) {
  (void)agent.add(KeyframeOdometry{.id = {robot, 0}});
  for (const PoseEdge& e : problem.edges)
    if (is_step(e) && e.from.robot == robot) (void)agent.add(keyframe_after(e));
  feed_closures(agent, robot, problem);
}

/// Adds all robots of the problem with their graphs.
inline void add_all(TeamNetwork& network, const TeamProblem& problem,
                    const MemberSolverFactory& factory, const PoseGraphConfig& config = {}) {
  for (const auto& [robot, start] : problem.start)
    feed(network.add({robot, 1}, config, factory), robot, problem);
}

/// Runs until all running robots are members of one settled session. False if that takes longer.
inline bool settle(TeamNetwork& network, double within_s = 300.0) {
  return network.run(within_s, [&] { return network.all_settled(); });
}

/// Checks that the published poses, in one frame, are the optimum of the problem.
inline void check_cost(const TeamNetwork& network, const TeamProblem& problem,
                       double tolerance = kCostTolerance) {
  const CentralProblem whole(problem);
  CHECK(whole.cost(network.trajectories()) ==
        Approx(whole.optimum(problem.start)).epsilon(tolerance));
}

[[nodiscard]] inline bool has_notice(const TeamNetwork& network, RobotId robot,
                                     const std::string& text) {
  return std::ranges::any_of(network.robots.at(robot).notices, [&](const std::string& notice) {
    return notice.find(text) != notice.npos;
  });
}

}  // namespace km
