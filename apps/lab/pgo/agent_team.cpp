#include "apps/lab/pgo/agent_team.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "modules/outlier_rejection/witnessed_pair.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"
#include "modules/robust/odometry_cycles.hpp"
#include "modules/session/team_agent.hpp"
#include "modules/session/team_message_bytes.hpp"

namespace km {
namespace {

constexpr double kLongest_s = 3600.0;  // virtual time of a run
constexpr double kTick_s = 0.05;       // period of TeamNode
constexpr double kDelay_s = 1e-3;
constexpr double kLatestMeeting_s = 20.0;  // with random times
constexpr double kMeanDelay_s = 0.03;      // with random times
constexpr double kOutage_s = 2.0, kLastOutage_s = 40.0;
constexpr double kAway = 1.0 / 3.0;  // probability that a robot is out of reach
// Most bytes with which the network states kind, number and receiver of a message of its sender.
constexpr std::size_t kMessageHead = 8;
// Longest wait for the next session, beyond PoseGraphConfig::session_wait_s. A team without a
// change for that long is finished.
constexpr double kMargin_s = 5.0;

bool inside_a_robot(const TeamGraph& graph, const BlockEdge& e) {
  return graph.robot_of(e.i) == graph.robot_of(e.j);
}

using RobotPair = std::pair<RobotId, RobotId>;

// The state of keyframe 0 in which its measured vertical is up.
SE3 upright_pose(const Eigen::Vector3d& up) {
  return make_pose(
      Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
      Eigen::Vector3d::Zero());
}

// A closure, and the time at which both of its ends have been played.
struct PlayedClosure {
  double at_s = 0.0;
  Closure closure;
};

// Decides whether a pair of robots is joined, as PcmNode does.
class PlayedPair {
 public:
  // The robots meet at `met_s`.
  PlayedPair(const RobotPair& pair, const PcmConfig& config, double met_s)
      : pair_(pair),
        wait_s_(config.witness_wait_s),
        met_s_(met_s),
        closures_(pair.first, pair.second, config) {}

  void add(const Closure& closure, double now_s) {
    const PcmAddResult result = closures_.add(closure);
    changed_ |= result == PcmAddResult::kAdded || result == PcmAddResult::kGrew;
    if (!since_s_) since_s_ = now_s;
  }
  // The inlier set, if it has changed and its closures count.
  std::optional<InlierSet> take(double now_s) {
    const bool inside = pair_.first == pair_.second;
    if (!changed_ || now_s < met_s_ ||
        !(inside || closures_.is_witnessed() || now_s - *since_s_ >= wait_s_))
      return std::nullopt;
    changed_ = false;
    return InlierSet{pair_.first, pair_.second, ++version_, closures_.closures()};
  }
  [[nodiscard]] bool waits() const { return changed_; }

 private:
  RobotPair pair_;
  double wait_s_;
  double met_s_;
  WitnessedPair closures_;
  std::optional<double> since_s_;
  bool changed_ = false;
  std::uint32_t version_ = 0;
};

class AgentTeam {
 public:
  AgentTeam(const TeamGraph& graph, const AgentTeamOptions& options)
      : graph_(graph), options_(options), rng_(options.seed) {
    for (std::size_t k = 0; k < graph.robots(); ++k) {
      odometry_.push_back(odometry_steps(graph, k));
      starts_s_.push_back(random_s(kLatestMeeting_s));
    }
    for (const VerticalPrior& prior : graph.verticals)
      verticals_[graph.keyframe_of(prior.pose)] = {prior.up, 1.0 / std::sqrt(prior.weight)};
    for (const TeamClosure& measured : team_closures(graph)) {
      const Closure& closure = measured.closure;
      const auto later = std::max(closure.from.id.index, closure.to.id.index);
      const double started_s =
          std::max(starts_s_[closure.from.id.robot], starts_s_[closure.to.id.robot]);
      closures_.push_back({started_s + played_s(later), closure});
      closures_.back().closure.covariance = covariance_of(precision_at(measured.edge));
    }
    std::ranges::stable_sort(closures_, {}, &PlayedClosure::at_s);
    for (std::size_t k = 0; k < graph.robots(); ++k)
      members_.push_back(
          {.agent = std::make_unique<TeamAgent>(options.pose_graph, peer(k),
                                                solver_choice(options.pose_graph, graph.dimension),
                                                graph.dimension)});
    report_links();
  }

  AgentTeamRun run() {
    const double quiet_s = options_.pose_graph.session_wait_s + kMargin_s;
    double last_change_s = 0.0;
    while (now_s_ - last_change_s < quiet_s && now_s_ < kLongest_s) {
      const bool played = play();
      draw_outages();
      const bool idle = exchange();
      if (played || pending() || !settled()) last_change_s = now_s_;
      if (settled() && changed_) last_change_s = now_s_;
      changed_ = false;
      const double next_s =
          in_flight_.empty() ? next_tick_s_ : std::min(next_tick_s_, in_flight_.begin()->first);
      now_s_ = idle ? std::max(now_s_, next_s) : now_s_ + kDelay_s;
      if (now_s_ < next_tick_s_) continue;
      next_tick_s_ = now_s_ + kTick_s;
      for (Member& member : members_) member.due = true;
    }
    return result(now_s_ - last_change_s >= quiet_s, last_change_s);
  }

 private:
  struct Member {
    std::unique_ptr<TeamAgent> agent;
    std::optional<Trajectory> trajectory = {};
    OptimizerProgress progress = {};
    std::size_t keyframes = 0;      // played
    std::size_t session_bytes = 0;  // sent
    AgentCost cost = {};
    bool due = true;
    bool away = false;  // out of reach
  };
  struct Delivery {
    std::size_t from = 0;
    std::size_t to = 0;
    TeamMessage message;
  };

  static TeamPeer peer(std::size_t robot) { return {static_cast<RobotId>(robot), 1}; }
  // A random time; 0 without a seed.
  double random_s(double latest_s) {
    return options_.seed == 0 ? 0.0 : std::uniform_real_distribution<double>(0.0, latest_s)(rng_);
  }
  [[nodiscard]] Precision precision_at(std::size_t edge) const {
    return {graph_.edges[edge].kappa, graph_.edges[edge].tau};
  }
  [[nodiscard]] double played_s(KeyframeIndex keyframe) const {
    return options_.keyframes_per_s > 0.0 ? keyframe / options_.keyframes_per_s : 0.0;
  }

  // Another third of the robots is out of reach.
  void draw_outages() {
    if (!options_.outages || now_s_ < next_outage_s_ || next_outage_s_ > kLastOutage_s) return;
    next_outage_s_ += kOutage_s;
    for (Member& member : members_)
      member.away = next_outage_s_ <= kLastOutage_s && random_s(1.0) < kAway;
    report_links();
  }

  void report_links() {
    LinksReport links{.links = {}, .version = ++links_version_};
    for (std::size_t k = 0; k < members_.size(); ++k) {
      std::set<RobotId> others;
      for (std::size_t other = 0; other < members_.size(); ++other)
        if (other != k && !members_[k].away && !members_[other].away)
          others.insert(static_cast<RobotId>(other));
      links.links.report(static_cast<RobotId>(k), std::move(others));
    }
    for (const Member& member : members_) member.agent->update_links(links);
  }

  // Gives the robots their measurements up to now. True if there were any.
  bool play() {
    bool any = false;
    for (std::size_t k = 0; k < members_.size(); ++k) {
      Member& member = members_[k];
      const auto poses = static_cast<std::size_t>(graph_.poses_of(k));
      for (std::size_t& i = member.keyframes;
           i < poses && starts_s_[k] + played_s(static_cast<KeyframeIndex>(i)) <= now_s_; ++i) {
        KeyframeOdometry keyframe;
        keyframe.id = {static_cast<RobotId>(k), static_cast<KeyframeIndex>(i)};
        if (const auto vertical = verticals_.find(keyframe.id); vertical != verticals_.end()) {
          keyframe.vertical = vertical->second;
          if (i == 0) keyframe.T_odom_kf = upright_pose(vertical->second.up_body);
        }
        if (i > 0) {
          keyframe.T_previous_kf = odometry_[k][i - 1].T_from_to;
          keyframe.covariance = covariance_of(odometry_[k][i - 1].precision);
        }
        (void)member.agent->add(keyframe);
        member.due = any = true;
      }
    }
    for (; next_closure_ < closures_.size() && closures_[next_closure_].at_s <= now_s_;
         ++next_closure_) {
      const Closure& closure = closures_[next_closure_].closure;
      const RobotPair pair = std::minmax({closure.from.id.robot, closure.to.id.robot});
      for (const RobotId robot : std::set{pair.first, pair.second})
        (void)members_[robot].agent->add(closure);
      const double met_s = pairs_.contains(pair) ? 0.0 : random_s(kLatestMeeting_s);
      pairs_.try_emplace(pair, pair, options_.pcm, met_s).first->second.add(closure, now_s_);
      any = true;
    }
    for (auto& [pair, played] : pairs_)
      if (const auto set = played.take(now_s_)) {
        for (const RobotId robot : std::set{pair.first, pair.second}) {
          (void)members_[robot].agent->add(*set);
          members_[robot].due = true;
        }
        any = true;
      }
    return any;
  }

  [[nodiscard]] bool pending() const {
    return next_closure_ < closures_.size() ||
           std::ranges::any_of(pairs_, [](const auto& pair) { return pair.second.waits(); });
  }

  // The time at which a message arrives. Messages of one origin and kind arrive in order, except
  // for reliable ones.
  double arrival_s(std::size_t robot, std::size_t to, const TeamMessage& message) {
    if (options_.seed == 0) return now_s_ + kDelay_s;
    const double at_s = now_s_ + std::exponential_distribution<double>(1.0 / kMeanDelay_s)(rng_);
    if (std::holds_alternative<ReliableMessage>(message)) return at_s;
    double& last_s = last_arrival_s_[{robot, to, message.index()}];
    return last_s = std::max(last_s, at_s);
  }

  // Calls work(agent) and adds its CPU time to that of the robot.
  decltype(auto) measure(Member& member, auto&& work) {
    const CpuStopwatch stopwatch{options_.meter, member.cost.cpu_s};
    return work(*member.agent);
  }

  // Delivers the messages in flight and steps each robot that is due. True if no robot is due and
  // no message is in flight afterwards.
  bool exchange() {
    std::vector<double> before_s;
    for (const Member& member : members_) before_s.push_back(member.cost.cpu_s);
    while (!in_flight_.empty() && in_flight_.begin()->first <= now_s_) {
      const Delivery delivery = in_flight_.extract(in_flight_.begin()).mapped();
      if (members_[delivery.from].away || members_[delivery.to].away) {
        in_flight_.emplace(next_outage_s_, delivery);
        continue;
      }
      measure(members_[delivery.to],
              [&](TeamAgent& agent) { (void)agent.receive(delivery.message); });
      members_[delivery.to].due = true;
    }
    for (std::size_t k = 0; k < members_.size(); ++k)
      if (members_[k].due) step(k);
    double slowest_s = 0.0;
    for (std::size_t k = 0; k < members_.size(); ++k)
      slowest_s = std::max(slowest_s, members_[k].cost.cpu_s - before_s[k]);
    critical_path_s_ += slowest_s;
    return std::ranges::none_of(members_, [](const Member& member) { return member.due; });
  }

  void step(std::size_t robot) {
    Member& member = members_[robot];
    TeamOutput output =
        measure(member, [&](TeamAgent& agent) { return agent.step(now_s_, member.session_bytes); });
    member.due = output.more;
    changed_ |= output.trajectory.has_value();
    if (output.trajectory) member.trajectory = std::move(output.trajectory);
    if (output.progress) member.progress = std::move(*output.progress);
    for (const TeamMessage& message : output.messages) send(robot, message);
  }

  // Sends a message to its receivers: robots that all receive each other.
  void send(std::size_t robot, const TeamMessage& message) {
    const std::vector<std::uint8_t> bytes = encode(message);
    const auto* reliable = std::get_if<ReliableMessage>(&message);
    for (std::size_t to = 0; to < members_.size(); ++to) {
      if (to == robot || (reliable != nullptr && reliable->to != to)) continue;
      auto decoded = decode_team_message({.kind = kind_of(message),
                                          .sender = peer(robot),
                                          .to = static_cast<RobotId>(to),
                                          .bytes = bytes});
      if (!decoded.value) throw std::runtime_error("run_agent_team: a message cannot be decoded");
      in_flight_.emplace(arrival_s(robot, to, message),
                         Delivery{robot, to, std::move(*decoded.value)});
      const std::size_t sent = kMessageHead + bytes.size();
      members_[robot].session_bytes += std::holds_alternative<TeamStatus>(message) ? 0 : sent;
      members_[robot].cost.sent += sent;
      members_[to].cost.received += sent;
      bytes_ += sent;
    }
  }

  [[nodiscard]] bool settled() const {
    return std::ranges::all_of(members_,
                               [](const Member& member) { return member.progress.settled; });
  }

  [[nodiscard]] AgentTeamRun result(bool settled, double seconds) const {
    AgentTeamRun run{.T_world_kf = {},
                     .world_of = {},
                     .kept = odometry_edges(graph_),
                     .settled = settled,
                     .seconds = seconds,
                     .last = members_.front().agent->part()->progress(),
                     .critical_path_s = critical_path_s_,
                     .bytes = bytes_,
                     .costs = {}};
    for (const Member& member : members_) run.costs.push_back(member.cost);
    for (std::size_t k = 0; k < members_.size(); ++k) {
      const Member& member = members_[k];
      const std::size_t named_by = publishes(k) ? k : publisher_beside(k);
      const SE3 T_world_frame = publishes(named_by) ? T_world_frame_of(named_by) : SE3::Identity();
      for (const SE3& T_frame_kf : member.agent->poses())
        run.T_world_kf.push_back(T_world_frame * T_frame_kf);
      if (publishes(k))
        std::ranges::copy(member.trajectory->T_world_kf,
                          run.T_world_kf.end() - static_cast<std::ptrdiff_t>(graph_.poses_of(k)));
      run.world_of.push_back(publishes(named_by) ? members_[named_by].trajectory->anchor
                                                 : static_cast<RobotId>(named_by));
      run.rounds = std::max(run.rounds, static_cast<std::size_t>(member.progress.round));
    }
    for (const TeamClosure& measured : team_closures(graph_)) {
      const ClosureId id = measured.closure.id();
      const auto [a, b] = std::pair(id.from.robot, id.to.robot);
      run.kept[measured.edge] =
          run.world_of[a] == run.world_of[b] && !rejects(a, id) && !rejects(b, id);
    }
    return run;
  }

  [[nodiscard]] bool publishes(std::size_t robot) const {
    const auto& trajectory = members_[robot].trajectory;
    return trajectory &&
           std::ssize(trajectory->T_world_kf) == std::ptrdiff_t{graph_.poses_of(robot)};
  }
  [[nodiscard]] SE3 T_world_frame_of(std::size_t robot) const {
    const Member& member = members_[robot];
    return member.trajectory->T_world_kf.front() * member.agent->poses().front().inverse();
  }
  // A robot publishes nothing while its last run is not located. Its poses are then in the frame of
  // the session, whose place another member may know: the first one that publishes, otherwise the
  // lowest one.
  [[nodiscard]] std::size_t publisher_beside(std::size_t robot) const {
    std::optional<std::size_t> lowest;
    for (std::size_t k = 0; k < members_.size(); ++k) {
      const Member& other = members_[k];
      if (other.agent->frame() != members_[robot].agent->frame() ||
          std::ranges::binary_search(other.progress.not_joined, static_cast<RobotId>(robot)))
        continue;
      if (publishes(k)) return k;
      if (!lowest) lowest = k;
    }
    return lowest.value_or(robot);
  }
  [[nodiscard]] bool rejects(RobotId robot, const ClosureId& id) const {
    const auto& decided = members_[robot].agent->decided();
    const auto verdict = decided.find(id);
    return verdict != decided.end() && !verdict->second;
  }

  const TeamGraph& graph_;
  const AgentTeamOptions& options_;
  std::vector<std::vector<PoseEdge>> odometry_;  // steps of each robot
  std::vector<PlayedClosure> closures_;          // ascending by time
  std::size_t next_closure_ = 0;
  std::map<RobotPair, PlayedPair> pairs_;
  std::vector<Member> members_;
  std::mt19937 rng_;
  std::vector<double> starts_s_;  // by robot
  std::map<KeyframeId, Vertical> verticals_;
  std::multimap<double, Delivery> in_flight_;  // by time of arrival
  std::map<std::tuple<std::size_t, std::size_t, std::size_t>, double> last_arrival_s_;
  double critical_path_s_ = 0.0;
  std::size_t bytes_ = 0;
  double now_s_ = 0.0;
  double next_tick_s_ = 0.0;
  double next_outage_s_ = 0.0;
  std::uint64_t links_version_ = 0;
  bool changed_ = false;
};

}  // namespace

std::vector<TeamClosure> team_closures(const TeamGraph& graph) {
  const auto covariance = [&](const Precision& precision) {
    return covariance_in(precision, graph.dimension);
  };
  std::vector<OdometryPose> poses;
  for (std::size_t robot = 0; robot < graph.robots(); ++robot) {
    RecordedGraph chain;
    chain.robot = static_cast<RobotId>(robot);
    for (const PoseEdge& step : odometry_steps(graph, robot))
      chain.odometry.push_back({step.from, step.to, step.T_from_to, covariance(step.precision)});
    std::ranges::move(odometry_poses(chain), std::back_inserter(poses));
  }
  const std::vector<bool> step = odometry_edges(graph);
  std::vector<TeamClosure> closures;
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    const BlockEdge& e = graph.edges[k];
    if (step[k] && inside_a_robot(graph, e)) continue;
    closures.push_back({k, Closure{.from = poses[static_cast<std::size_t>(e.i)],
                                   .to = poses[static_cast<std::size_t>(e.j)],
                                   .T_from_to = e.T_i_j,
                                   .covariance = covariance({e.kappa, e.tau})}});
  }
  return closures;
}

AgentTeamRun run_agent_team(const TeamGraph& graph, const AgentTeamOptions& options) {
  return AgentTeam(graph, options).run();
}

}  // namespace km
