#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "modules/core/geometry/lie.hpp"
#include "modules/robust/member_solver.hpp"
#include "modules/robust/session_graph.hpp"
#include "modules/session/team_messages.hpp"
#include "test/support/pose_graph_problems.hpp"

namespace km {

using TeamPoses = std::map<RobotId, std::vector<SE3>>;

/// The graph of a team, and the initial poses of a session.
struct TeamProblem {
  TeamPoses start = {};
  std::vector<PoseEdge> edges = {};  ///< Odometry of all robots, then closures, each pair once.
  std::map<RobotId, std::vector<VerticalPrior>> verticals = {};
  std::set<RobotId> absent = {};  ///< Robots of `start` that have left.
  std::map<ClosureId, bool> decided = {};
  TeamPoses truth = {};  ///< Empty if unknown.

  [[nodiscard]] std::vector<RobotId> members() const {
    std::vector<RobotId> ids;
    for (const auto& [robot, poses] : start)
      if (!absent.contains(robot)) ids.push_back(robot);
    return ids;
  }
};

[[nodiscard]] inline bool is_step(const PoseEdge& e) {
  return e.from.robot == e.to.robot && e.to.index == e.from.index + 1;
}

/// Sorts edges as in TeamProblem, odometry first; repeated pairs of closures are left out.
[[nodiscard]] inline std::vector<PoseEdge> in_order(const std::vector<PoseEdge>& edges) {
  std::map<ClosureId, PoseEdge> odometry, closures;
  for (const PoseEdge& e : edges)
    if (!is_step(e) || !odometry.try_emplace(e.id(), e).second) closures.try_emplace(e.id(), e);
  std::vector<PoseEdge> result;
  for (const auto* kind : {&odometry, &closures})
    for (const auto& [id, e] : *kind) result.push_back(e);
  return result;
}

/// Rounds public poses to single precision, because all robots hold them so before a session.
[[nodiscard]] inline TeamPoses with_public_poses_rounded(TeamPoses poses,
                                                         const std::vector<PoseEdge>& edges) {
  std::set<KeyframeId> ends;
  for (const PoseEdge& e : edges)
    if (e.from.robot != e.to.robot) ends.insert({e.from, e.to});
  for (const auto& [robot, of_robot] : poses) ends.insert({robot, 0});
  for (const KeyframeId& id : ends) {
    SE3& T = poses.at(id.robot).at(id.index);
    T = SinglePose::of(T).pose();
  }
  return poses;
}

/// A g2o file of one robot split among robots 1, 3, 5, ... in blocks of equal length. It starts
/// from chordal initialisation.
[[nodiscard]] inline TeamProblem deal_file(const std::filesystem::path& file, std::size_t robots) {
  const auto [poses, edges] = read_whole_graph(file);
  const auto length = static_cast<std::uint32_t>(poses) / static_cast<std::uint32_t>(robots);
  const auto dealt = [&](Eigen::Index pose) {
    const auto index = static_cast<std::uint32_t>(pose);
    const std::uint32_t k = std::min(index / length, static_cast<std::uint32_t>(robots) - 1);
    return KeyframeId{static_cast<RobotId>(2 * k + 1), index - k * length};
  };
  TeamProblem problem;
  const std::vector<SE3> start = chordal_initialisation(poses, edges);
  for (Eigen::Index i = 0; i < poses; ++i)
    problem.start[dealt(i).robot].push_back(start[static_cast<std::size_t>(i)]);
  for (const BlockEdge& e : edges)
    problem.edges.push_back({dealt(e.i), dealt(e.j), e.T_i_j, {e.kappa, e.tau}});
  problem.edges = in_order(problem.edges);
  problem.start = with_public_poses_rounded(std::move(problem.start), problem.edges);
  return problem;
}

/// Parameters of random_team_problem().
struct RandomTeam {
  std::vector<RobotId> robots = {};
  std::vector<std::pair<RobotId, RobotId>> pairs = {};  ///< Pairs of robots with closures.
  std::uint32_t keyframes = 20;                         ///< Number for each robot.
  int closures = 6;          ///< Number for each pair, and inside each robot.
  double sigma = 0.02;       ///< Standard deviation of measurements [rad, m].
  double start_sigma = 0.1;  ///< Standard deviation of the poses at the start [rad, m].
  double tilt_sigma = 0.0;   ///< Standard deviation of verticals [rad]; 0: none.
};

/// Robots that move in a box. Their measurements have the stated noise. z is up.
[[nodiscard]] inline TeamProblem random_team_problem(const RandomTeam& team, unsigned seed) {
  std::mt19937 rng(seed);
  const auto noisy = [&](const SE3& T, double sigma) {
    return T * se3_exp(Vector6(sigma * random_vector<6>(rng)));
  };
  TeamProblem problem;
  TeamPoses& truth = problem.truth;
  const Precision precision{0.5 / (team.sigma * team.sigma), 1.0 / (team.sigma * team.sigma)};
  const auto measure = [&](const KeyframeId& from, const KeyframeId& to) {
    const SE3 T = truth.at(from.robot)[from.index].inverse() * truth.at(to.robot)[to.index];
    problem.edges.push_back({from, to, noisy(T, team.sigma), precision});
  };
  for (const RobotId robot : team.robots) {
    SE3 T = random_pose(rng, 5.0);
    for (std::uint32_t i = 0; i < team.keyframes; ++i) {
      truth[robot].push_back(T);
      problem.start[robot].push_back(noisy(T, team.start_sigma));
      if (i > 0) measure({robot, i - 1}, {robot, i});
      if (team.tilt_sigma > 0.0) {
        const Eigen::Vector3d up = T.linear().transpose() * Eigen::Vector3d::UnitZ();
        const Eigen::Vector3d tilted = up + team.tilt_sigma * random_vector<3>(rng);
        problem.verticals[robot].push_back(
            {Eigen::Index{i}, tilted.normalized(), 1.0 / (team.tilt_sigma * team.tilt_sigma)});
      }
      const Eigen::Vector3d phi = 0.3 * random_vector<3>(rng);
      T = T * make_pose(so3_exp(phi), {1.0, 0.0, 0.0});
    }
  }
  std::vector<std::pair<RobotId, RobotId>> pairs = team.pairs;
  for (const RobotId robot : team.robots) pairs.emplace_back(robot, robot);
  std::uniform_int_distribution<std::uint32_t> any(0, team.keyframes - 1);
  for (const auto& [a, b] : pairs)
    for (int k = 0; k < team.closures; ++k) {
      const std::uint32_t i = any(rng);
      const std::uint32_t j = any(rng);
      if (a != b || i > j + 1) measure({a, i}, {b, j});
    }
  problem.edges = in_order(problem.edges);
  problem.start = with_public_poses_rounded(std::move(problem.start), problem.edges);
  return problem;
}

/// Input of the solver of `robot` in a session.
[[nodiscard]] inline SessionGraph session_graph(const TeamProblem& problem, RobotId robot) {
  SessionGraph graph{
      .self = robot, .start = problem.start.at(robot), .origin = {problem.members().front(), 0}};
  std::map<RobotId, std::pair<Precision, double>> steps;
  for (const PoseEdge& e : problem.edges) {
    const bool starts = e.from.robot == robot, ends = e.to.robot == robot;
    if (is_step(e)) {
      auto& [sum, count] = steps[e.from.robot];
      sum = {sum.kappa * (count > 0.0) + e.precision.kappa,
             sum.tau * (count > 0.0) + e.precision.tau};
      count += 1.0;
    }
    if (starts && ends) {
      graph.own.push_back(e);
      graph.odometry += is_step(e) && graph.odometry + 1 < graph.start.size() ? 1 : 0;
    } else if (starts || ends) {
      (problem.absent.contains(e.other(robot).robot) ? graph.to_absent : graph.between)
          .push_back(e);
    }
    for (const KeyframeId& id : {e.from, e.to})
      if (e.from.robot != e.to.robot && id.robot != robot)
        graph.public_poses.emplace(id, problem.start.at(id.robot)[id.index]);
  }
  for (const auto& [other, poses] : problem.start)
    if (other != robot) graph.public_poses.emplace(KeyframeId{other, 0}, poses[0]);
  for (const auto& [other, sum] : steps)
    graph.step_precision[other] = {sum.first.kappa / sum.second, sum.first.tau / sum.second};
  graph.upright = !problem.verticals.empty();
  if (const auto own = problem.verticals.find(robot); own != problem.verticals.end())
    graph.verticals = own->second;
  graph.decided = problem.decided;
  return graph;
}

/// The whole problem as one block, with the members' poses robot by robot.
class CentralProblem {
 public:
  explicit CentralProblem(const TeamProblem& problem) : members_(problem.members()) {
    std::map<RobotId, Eigen::Index> first;
    Eigen::Index poses = 0;
    for (const RobotId robot : members_) {
      first[robot] = poses;
      poses += static_cast<Eigen::Index>(problem.start.at(robot).size());
    }
    std::vector<BlockEdge> edges;
    std::vector<PublicEdge> to_fixed;
    std::vector<SE3> fixed;
    for (const PoseEdge& e : problem.edges) {
      const auto decided = problem.decided.find(e.id());
      const bool rejected = decided != problem.decided.end() && !decided->second && !is_step(e);
      const double kappa = e.precision.kappa * (rejected ? kRejectedWeight : 1.0);
      const double tau = e.precision.tau * (rejected ? kRejectedWeight : 1.0);
      const bool starts = first.contains(e.from.robot), ends = first.contains(e.to.robot);
      const auto number = [&](const KeyframeId& id) { return first.at(id.robot) + id.index; };
      if (starts && ends) {
        edges.push_back({number(e.from), number(e.to), e.T_from_to, kappa, tau});
      } else if (starts || ends) {
        to_fixed.push_back({number(starts ? e.from : e.to), static_cast<Eigen::Index>(fixed.size()),
                            starts, e.T_from_to, kappa, tau});
        const KeyframeId& other = starts ? e.to : e.from;
        fixed.push_back(problem.start.at(other.robot)[other.index]);
      }
    }
    std::vector<VerticalPrior> verticals;
    for (const auto& [robot, priors] : problem.verticals)
      for (VerticalPrior prior : priors)
        if (first.contains(robot)) {
          prior.pose += first.at(robot);
          verticals.push_back(prior);
        }
    problem_ = std::make_unique<QuadraticProblem>(3, poses, edges, to_fixed, verticals);
    problem_->set_fixed(lift(fixed, 3));
  }

  [[nodiscard]] double cost(const TeamPoses& poses) const { return problem_->cost(block(poses)); }

  /// Smallest cost that Newton's method finds from `start`.
  [[nodiscard]] double optimum(const TeamPoses& start) const {
    return minimise(*problem_, block(start),
                    {.max_iterations = 300,
                     .max_cg_iterations = 2000,
                     .cg_tolerance = 1e-3,
                     .gradient_tolerance = 1e-7})
        .cost;
  }

 private:
  [[nodiscard]] LiftedPoses block(const TeamPoses& poses) const {
    std::vector<SE3> all;
    for (const RobotId robot : members_)
      all.insert(all.end(), poses.at(robot).begin(), poses.at(robot).end());
    return lift(all, 3);
  }

  std::vector<RobotId> members_;
  std::unique_ptr<QuadraticProblem> problem_;
};

using TeamTree = std::map<RobotId, TreePlace>;

/// Parent of every member except for the root.
[[nodiscard]] inline TeamTree tree_of(const std::vector<RobotId>& members,
                                      const std::map<RobotId, RobotId>& parents) {
  TeamTree tree;
  for (const RobotId robot : members) {
    TreePlace& place = tree[robot];
    place.members = members;
    if (const auto parent = parents.find(robot); parent != parents.end())
      place.parent = parent->second;
    for (const RobotId child : members)
      if (const auto parent = parents.find(child);
          parent != parents.end() && parent->second == robot)
        place.children.push_back(child);
    for (const RobotId root : members)
      if (!parents.contains(root)) place.root = root;
  }
  return tree;
}

/// All others are children of member number `root`.
[[nodiscard]] inline TeamTree star(const std::vector<RobotId>& members, std::size_t root = 0) {
  std::map<RobotId, RobotId> parents;
  for (const RobotId robot : members)
    if (robot != members[root]) parents[robot] = members[root];
  return tree_of(members, parents);
}

/// In the order of `members`, the root in the middle.
[[nodiscard]] inline TeamTree chain(const std::vector<RobotId>& members) {
  std::map<RobotId, RobotId> parents;
  const std::size_t root = members.size() / 2;
  for (std::size_t k = 0; k < members.size(); ++k)
    if (k != root) parents[members[k]] = members[k < root ? k + 1 : k - 1];
  return tree_of(members, parents);
}

/// Faults of the transport of messages, in steps of the clock.
struct TransportFaults {
  int max_delay = 0;        ///< Each message is delayed by 0 to this many steps, so that messages
                            ///< overtake each other.
  double duplicated = 0.0;  ///< Share of the messages that arrive twice.
  unsigned seed = 1;
};

/// Members of a session with the messages between them. In a step of the clock messages arrive,
/// then every member works that has something to do. With delays, a random half of them works.
class SolverTeam {
 public:
  using Members = std::map<RobotId, std::unique_ptr<MemberSolver>>;

  explicit SolverTeam(Members members, const TransportFaults& faults = {})
      : members_(std::move(members)), faults_(faults), rng_(faults.seed) {}

  /// Runs until all are done. False if that takes more steps, or if no member has anything left to
  /// do.
  bool run(std::size_t max_steps = 100000) {
    for (std::size_t n = 0; n < max_steps; ++n) {
      if (done()) return true;
      if (!step()) return done();
    }
    return done();
  }

  /// False if no member has anything to do and no message is in flight.
  bool step() {
    ++now_;
    deliver();
    bool busy = !in_flight_.empty();
    for (auto& [robot, member] : members_) {
      if (!member->ready()) continue;
      busy = true;
      if (faults_.max_delay > 0 && std::bernoulli_distribution(0.5)(rng_)) continue;
      for (SolverMessage& message : member->advance()) send(robot, std::move(message));
    }
    return busy;
  }

  /// Disconnects the member.
  void remove(RobotId robot) { members_.erase(robot); }

  [[nodiscard]] bool done() const {
    return std::all_of(members_.begin(), members_.end(),
                       [](const auto& member) { return member.second->done(); });
  }
  [[nodiscard]] MemberSolver& member(RobotId robot) { return *members_.at(robot); }
  [[nodiscard]] TeamPoses poses() const {
    TeamPoses poses;
    for (const auto& [robot, member] : members_) poses[robot] = member->poses();
    return poses;
  }
  /// Refused messages, copies included.
  [[nodiscard]] std::size_t refused() const { return refused_; }

  std::function<void(RobotId, std::span<const std::uint8_t>)> on_sent = {};  ///< From, bytes.

 private:
  struct Delivery {
    RobotId from = 0;
    SolverMessage message;
  };

  void send(RobotId from, SolverMessage message) {
    if (on_sent) on_sent(from, *message.bytes);
    const int copies = std::bernoulli_distribution(faults_.duplicated)(rng_) ? 2 : 1;
    for (int copy = 0; copy < copies; ++copy) {
      const int delay = std::uniform_int_distribution<int>(0, faults_.max_delay)(rng_);
      in_flight_.emplace(now_ + 1 + static_cast<std::size_t>(delay), Delivery{from, message});
    }
  }

  void deliver() {
    std::vector<Delivery> due;
    while (!in_flight_.empty() && in_flight_.begin()->first <= now_)
      due.push_back(in_flight_.extract(in_flight_.begin()).mapped());
    if (faults_.max_delay > 0) std::shuffle(due.begin(), due.end(), rng_);
    for (const Delivery& delivery : due) {
      const auto to = members_.find(delivery.message.to);
      if (to != members_.end() && !to->second->receive(delivery.from, *delivery.message.bytes))
        ++refused_;
    }
  }

  Members members_;
  TransportFaults faults_;
  std::mt19937 rng_;
  std::multimap<std::size_t, Delivery> in_flight_;
  std::size_t refused_ = 0;
  std::size_t now_ = 0;
};

/// A member for every place of the tree: `make(graph, place)` returns the solver.
template <typename Make>
[[nodiscard]] SolverTeam solver_team(const TeamProblem& problem, const TeamTree& tree,
                                     const TransportFaults& faults, Make&& make) {
  SolverTeam::Members members;
  for (const auto& [robot, place] : tree)
    members[robot] = make(session_graph(problem, robot), place);
  return SolverTeam(std::move(members), faults);
}

}  // namespace km
