#pragma once

#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <variant>
#include <vector>

#include "modules/pose_graph/pgo_agent.hpp"

namespace km {

/// How the in-memory network of a PgoTeam treats messages.
struct NetworkConditions {
  double max_delay_s = 0.0;  ///< Uniform from 0: also reorders.
  double duplicated = 0.0;   ///< Probability of a second copy, delayed anew.
  double lost = 0.0;         ///< Probability.
  unsigned seed = 1;
};

/// Agents of a team in one process, on a network with virtual time.
class PgoTeam {
 public:
  explicit PgoTeam(NetworkConditions network = {}) : network_(network), rng_(network.seed) {}

  PgoAgent& add(PgoPeer peer, const PoseGraphConfig& config) {
    Robot& robot = robots_[peer.robot];
    robot.peer = peer;
    robot.agent = std::make_unique<PgoAgent>(config, peer);
    for (auto& [id, other] : robots_) {
      if (id == peer.robot) continue;
      other.agent->peer_alive(peer);
      robot.agent->peer_alive(other.peer);
    }
    return *robot.agent;
  }

  /// The process ends: the others hear of it, nothing of it arrives any more.
  void remove(RobotId robot) {
    robots_.erase(robot);
    std::erase_if(in_flight_, [&](const auto& entry) {
      return entry.second.to == robot || entry.second.from == robot;
    });
    for (auto& [id, other] : robots_) other.agent->peer_lost(robot);
  }

  /// The robot goes out of reach; what is in flight to and from it is lost.
  void disconnect(RobotId robot) {
    unreachable_.insert(robot);
    std::erase_if(in_flight_, [&](const auto& entry) {
      return entry.second.to == robot || entry.second.from == robot;
    });
    for (auto& [id, other] : robots_) {
      if (id == robot) continue;
      other.agent->peer_lost(robot);
      robots_.at(robot).agent->peer_lost(id);
    }
  }

  void reconnect(RobotId robot) {
    unreachable_.erase(robot);
    for (auto& [id, other] : robots_) {
      if (id == robot || unreachable_.contains(id)) continue;
      other.agent->peer_alive(robots_.at(robot).peer);
      robots_.at(robot).agent->peer_alive(other.peer);
    }
  }

  PgoAgent& agent(RobotId robot) { return *robots_.at(robot).agent; }
  const Trajectory* trajectory(RobotId robot) const {
    const auto& trajectory = robots_.at(robot).trajectory;
    return trajectory ? &*trajectory : nullptr;
  }
  const OptimizerProgress& progress(RobotId robot) const { return robots_.at(robot).progress; }
  /// When a solver that rejects closures last came to the end.
  const std::optional<ClosureVerdicts>& verdicts(RobotId robot) const {
    return robots_.at(robot).verdicts;
  }
  std::size_t bytes_sent() const { return bytes_; }
  double now_s() const { return now_s_; }

  /// Runs for `duration_s` of virtual time, or until `done`. Called after every update with poses.
  bool run(
      double duration_s, const std::function<bool()>& done = [] { return false; }) {
    constexpr double kTick_s = 1e-3;
    for (const double end = now_s_ + duration_s; now_s_ < end; now_s_ += kTick_s) {
      deliver();
      for (auto& [id, robot] : robots_) step(robot);
      if (done()) return true;
    }
    return false;
  }

  /// True if all robots are members of one settled session.
  bool all_settled() const {
    for (const auto& [id, robot] : robots_)
      if (!robot.progress.settled || robot.progress.members.size() != robots_.size()) return false;
    return true;
  }

  std::function<void(RobotId)> on_update;  ///< After every update that sends something of it.
  /// Sees every message of an exchange, and may put another one in its place.
  std::function<SolverMessagePtr(const SolverMessagePtr&)> on_exchange;
  std::vector<std::string> notices;

 private:
  using Message = std::variant<PgoStatus, PgoSession, PublicPoses, SolverMessagePtr>;
  struct Robot {
    PgoPeer peer;
    std::unique_ptr<PgoAgent> agent;
    std::optional<Trajectory> trajectory;
    OptimizerProgress progress;
    std::optional<ClosureVerdicts> verdicts;
  };
  struct Delivery {
    RobotId from, to;
    std::shared_ptr<const Message> message;
  };

  void step(Robot& robot) {
    for (bool more = true; more;) {
      PgoOutput output = robot.agent->step(now_s_);
      more = output.more;
      if (output.trajectory) robot.trajectory = std::move(output.trajectory);
      if (output.progress) robot.progress = std::move(*output.progress);
      if (output.verdicts) robot.verdicts = output.verdicts;
      if (output.notice) notices.push_back(*output.notice);
      if ((output.poses || !output.exchange.empty()) && on_update) on_update(robot.peer.robot);
      if (output.session) broadcast(robot, std::move(*output.session));
      if (output.poses) broadcast(robot, std::move(*output.poses));
      for (const SolverMessagePtr& message : output.exchange)
        broadcast(robot, on_exchange ? on_exchange(message) : message);
      if (output.status) broadcast(robot, std::move(*output.status));
    }
  }

  void broadcast(const Robot& from, Message content) {
    const auto message = std::make_shared<const Message>(std::move(content));
    if (const auto* poses = std::get_if<PublicPoses>(message.get()))
      bytes_ += 84 + 84 * poses->keyframes.size();  // index and 20 floats each
    if (const auto* exchanged = std::get_if<SolverMessagePtr>(message.get()))
      bytes_ += approximate_bytes(**exchanged);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (const auto& [id, robot] : robots_) {
      if (id == from.peer.robot) continue;
      if (unreachable_.contains(id) || unreachable_.contains(from.peer.robot)) continue;
      const bool lost = uniform(rng_) < network_.lost;
      const int copies = lost ? 0 : uniform(rng_) < network_.duplicated ? 2 : 1;
      for (int copy = 0; copy < copies; ++copy) {
        const double delay_s = network_.max_delay_s * uniform(rng_);
        in_flight_.emplace(now_s_ + delay_s, Delivery{from.peer.robot, id, message});
      }
    }
  }

  void deliver() {
    while (!in_flight_.empty() && in_flight_.begin()->first <= now_s_) {
      const Delivery delivery = in_flight_.extract(in_flight_.begin()).mapped();
      PgoAgent& agent = *robots_.at(delivery.to).agent;
      std::visit([&](const auto& message) { (void)agent.receive(message); }, *delivery.message);
    }
  }

  NetworkConditions network_;
  std::mt19937 rng_;
  std::map<RobotId, Robot> robots_;
  std::set<RobotId> unreachable_;
  std::multimap<double, Delivery> in_flight_;
  double now_s_ = 0.0;
  std::size_t bytes_ = 0;
};

}  // namespace km
