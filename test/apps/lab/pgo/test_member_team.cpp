#include <catch2/catch.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "apps/lab/pgo/central_solver.hpp"
#include "apps/lab/pgo/member_team.hpp"
#include "apps/lab/pgo/odometry_start.hpp"
#include "apps/lab/pgo/team_graph_file.hpp"
#include "modules/outlier_rejection/random_outliers.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/tree_newton.hpp"
#include "modules/rbcd/rounding.hpp"
#include "test/support/eavesdropper.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/team_graphs.hpp"

namespace km {
namespace {

using Eigen::Index;

// A team that gives access to each member.
class AskedTeam {
 public:
  AskedTeam(const TeamGraph& graph, std::vector<SE3> start, TreeNewtonOptions options,
            TeamShape shape = TeamShape::kAll)
      : graph_(graph),
        members_(graph.robots()),
        neighbours_(graph.robots()),
        meter_(graph.robots(), {}) {
    options.dimension = graph.dimension;
    team_.emplace(
        graph_, 3, std::move(start),
        [this, options](SessionGraph part, TreePlace place) {
          const RobotId self = part.self;
          neighbours_[self] = {place.children.begin(), place.children.end()};
          if (place.parent) neighbours_[self].insert(*place.parent);
          auto member = std::make_unique<TreeNewton>(std::move(part), std::move(place), options);
          members_[self] = member.get();
          return std::make_unique<ObservedMember>(std::move(member),
                                                  [this, self](const SolverMessage& message) {
                                                    message_bytes_ += message.bytes->size();
                                                    if (!neighbours_[self].contains(message.to))
                                                      ++misaddressed_;
                                                  });
        },
        shape);
  }
  AskedTeam(const AskedTeam&) = delete;
  AskedTeam& operator=(const AskedTeam&) = delete;

  bool step() { return team_->step(meter_); }
  // False: the team has not ended.
  bool run(int max_rounds) {
    for (int round = 0; round <= max_rounds; ++round)
      if (!step()) return true;
    return false;
  }
  [[nodiscard]] std::vector<SE3> poses() const {
    std::vector<SE3> poses;
    for (const TreeNewton* member : members_)
      poses.insert(poses.end(), member->poses().begin(), member->poses().end());
    return poses;
  }
  [[nodiscard]] const MemberTeam& team() const { return *team_; }
  [[nodiscard]] const TreeNewton& member(std::size_t robot) const { return *members_[robot]; }
  [[nodiscard]] std::size_t message_bytes() const { return message_bytes_; }
  [[nodiscard]] std::size_t misaddressed() const { return misaddressed_; }
  [[nodiscard]] std::size_t counted_bytes() { return meter_.finish_round().bytes; }

 private:
  TeamGraph graph_;
  std::vector<TreeNewton*> members_;  // members of the last session; MemberTeam owns them
  std::vector<std::set<RobotId>> neighbours_;
  RoundMeter meter_;
  std::size_t message_bytes_ = 0;
  std::size_t misaddressed_ = 0;
  std::optional<MemberTeam> team_;
};

double cost_of_poses(const TeamGraph& graph, const std::vector<SE3>& poses) {
  return problem_of(graph, 3).cost(lift(poses, 3));
}

std::optional<TeamGraph> partitioned(const std::string& name, std::size_t robots) {
  const auto path = shared_data(name);
  if (!path) return std::nullopt;
  return partition_contiguously(read_g2o(*path), robots, name);
}

std::vector<SE3> optimum_of(const TeamGraph& graph) {
  CentralSolver central(graph.edges, lift(chordal_initialisation(graph.poses(), graph.edges), 3),
                        graph.dimension);
  while (central.step()) {
  }
  REQUIRE(central.certificate());
  REQUIRE(central.certificate()->certified);
  return round_to_poses(central.X(), central.X().leftCols<4>());
}

// RMSE of positions after rigid alignment.
double rmse_m(const std::vector<SE3>& truth, const std::vector<SE3>& estimate) {
  Eigen::Matrix3Xd a(3, truth.size()), b(3, truth.size());
  for (std::size_t k = 0; k < truth.size(); ++k) {
    a.col(static_cast<Index>(k)) = truth[k].translation();
    b.col(static_cast<Index>(k)) = estimate[k].translation();
  }
  const Eigen::Matrix4d T = Eigen::umeyama(b, a, false);
  const Eigen::Matrix3Xd aligned =
      (T.topLeftCorner<3, 3>() * b).colwise() + T.topRightCorner<3, 1>();
  return std::sqrt((aligned - a).colwise().squaredNorm().mean());
}

double half_side_m(const std::vector<SE3>& poses) {
  Eigen::AlignedBox3d box;
  for (const SE3& T : poses) box.extend(T.translation());
  return 0.5 * box.sizes().maxCoeff();
}

// Adds false closures between poses that no true edge joins, because a robot uses only one closure
// between two keyframes.
class Corrupter {
 public:
  Corrupter(TeamGraph graph, const std::vector<SE3>& truth, unsigned seed)
      : graph_(std::move(graph)), truth_(truth), half_side_m_(half_side_m(truth)), rng_(seed) {
    const std::vector<bool> odometry = odometry_edges(graph_);
    for (std::size_t k = 0; k < odometry.size(); ++k) {
      const BlockEdge& e = graph_.edges[k];
      joined_.insert(std::minmax(e.i, e.j));
      if (!odometry[k]) claims_.push_back({e.kappa, e.tau});
    }
  }

  void add_random(double share) {
    const auto count =
        static_cast<std::size_t>(std::lround(share * static_cast<double>(claims_.size())));
    const RandomOutlierModel model{.keyframes = static_cast<std::size_t>(graph_.poses()),
                                   .planar = graph_.dimension == 2,
                                   .half_side_m = half_side_m_};
    std::uniform_int_distribution<std::size_t> claim(0, claims_.size() - 1);
    for (std::size_t n = 0; n < count;) {
      const RelativePose e = random_outliers(1, model, rng_).front();
      if (add(Index{e.from.index}, Index{e.to.index}, e.T_from_to, claims_[claim(rng_)])) ++n;
    }
  }

  // Adds clusters between `size` consecutive poses of the first robot and of the last one.
  void add_clusters(std::size_t places, Index size) {
    const RandomOutlierModel model{
        .keyframes = 3, .planar = graph_.dimension == 2, .half_side_m = half_side_m_};
    const auto at = [&](Index pose) -> const SE3& {
      return truth_[static_cast<std::size_t>(pose)];
    };
    for (std::size_t n = 0; n < places; ++n) {
      const Index a = run_in(0, size);
      const Index b = run_in(graph_.robots() - 1, size);
      const SE3 T_a_b = random_outliers(1, model, rng_).front().T_from_to;
      for (Index k = 0; k < size; ++k)
        (void)add(a + k, b + k, at(a + k).inverse() * at(a) * T_a_b * at(b).inverse() * at(b + k),
                  claims_.front());
    }
  }

  [[nodiscard]] const TeamGraph& graph() const { return graph_; }

 private:
  bool add(Index i, Index j, const SE3& T_i_j, const Precision& claimed) {
    if (!joined_.insert(std::minmax(i, j)).second) return false;
    graph_.edges.push_back({i, j, T_i_j, claimed.kappa, claimed.tau});
    return true;
  }
  [[nodiscard]] Index run_in(std::size_t robot, Index size) {
    return std::uniform_int_distribution<Index>(graph_.first[robot],
                                                graph_.first[robot + 1] - size)(rng_);
  }

  TeamGraph graph_;
  const std::vector<SE3>& truth_;
  double half_side_m_;
  std::mt19937 rng_;
  std::set<std::pair<Index, Index>> joined_;
  std::vector<Precision> claims_;  // precisions of the true closures
};

constexpr int kMostRounds = 90;  // measured maximum: 81, in 180 runs of the slow tests below
// Until rounding limits the cost. As much patience as second derivatives save here.
const TreeNewtonOptions kExact{.absolute_tolerance = 0.0, .patience_rounds = 8.0};
const TreeNewtonOptions kTrusting{
    .absolute_tolerance = 0.0, .patience_rounds = 8.0, .robust = false};

struct Kept {
  std::size_t true_closures = 0;
  std::size_t of_true = 0;
  std::size_t false_closures = 0;
  std::size_t of_false = 0;
};

Kept count_kept(const MemberTeam& team, const TeamGraph& corrupted, std::size_t true_edges) {
  const std::vector<bool> odometry = odometry_edges(corrupted);
  const std::vector<bool> kept = team.kept();
  Kept count;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (odometry[k]) continue;
    ++(k < true_edges ? count.true_closures : count.false_closures);
    if (kept[k]) ++(k < true_edges ? count.of_true : count.of_false);
  }
  return count;
}

constexpr const char* kSphere = "pose_graphs/3d/sphere2500.g2o";
constexpr const char* kGarage = "pose_graphs/3d/parking-garage.g2o";

struct FalseClosures {
  double share = 0.0;  // random false closures per true one
  std::size_t places = 0;
  Index size = 0;  // closures of the cluster at each place
};

constexpr std::size_t kPlaces = 5;

TeamGraph corrupted_graph(const TeamGraph& clean, const std::vector<SE3>& truth,
                          const FalseClosures& added, unsigned seed) {
  Corrupter corrupter(clean, truth, seed);
  corrupter.add_random(added.share);
  corrupter.add_clusters(added.places, added.size);
  return corrupter.graph();
}

// Largest accepted RMSE to the optimum of the true closures. Measured with up to 100 false closures
// that agree, three seeds: at most 4.7e-7 m for the sphere, 9.8e-4 m for the garage, whose cost is
// flatter.
double most_rmse_m(const std::string& name) {
  return name == kSphere ? 1e-5 : 5e-3;
}

// Checks that a team with default options reaches the optimum of the true closures and keeps them
// all. Returns the number of rounds; 0 if there are no data.
std::uint32_t check_false_closures(const std::string& name, std::size_t robots,
                                   const FalseClosures& added, unsigned seed) {
  const auto clean = partitioned(name, robots);
  if (!clean) return 0;
  const std::vector<SE3> truth = optimum_of(*clean);
  const TeamGraph graph = corrupted_graph(*clean, truth, added, seed);
  REQUIRE(graph.edges.size() > clean->edges.size());
  AskedTeam asked(graph, odometry_start(graph), {});
  const bool ended = asked.run(kMostRounds);
  const Kept kept = count_kept(asked.team(), graph, clean->edges.size());
  CAPTURE(name, robots, added.share, added.places, added.size, seed);
  CAPTURE(asked.team().rounds(), asked.team().state().noise_scale);
  CHECK(ended);
  CHECK_FALSE(asked.team().state().failed);
  CHECK(kept.of_false == 0);
  CHECK(kept.of_true == kept.true_closures);
  CHECK(rmse_m(truth, asked.poses()) <= most_rmse_m(name));
  return asked.team().rounds();
}

TEST_CASE("A team rejects random false closures", "[pgo]") {
  (void)check_false_closures(kSphere, 3, {.share = 0.3}, 1);
}

TEST_CASE("A team rejects false closures that agree with each other", "[pgo]") {
  (void)check_false_closures(kSphere, 3, {.places = kPlaces, .size = 5}, 1);
}

// Number of closures by pair of robots, the lower one first.
std::map<std::pair<std::size_t, std::size_t>, std::size_t> closures_between(
    const TeamGraph& graph) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> count;
  for (const BlockEdge& e : graph.edges) {
    const std::size_t a = graph.robot_of(e.i), b = graph.robot_of(e.j);
    if (a != b) ++count[std::minmax(a, b)];
  }
  return count;
}

TEST_CASE("False closures of the pair with most closures do not place the robots", "[pgo]") {
  const FalseClosures added{.share = 0.1, .places = 8, .size = 10};
  const auto clean = partitioned(kSphere, 5);
  if (!clean) return;
  // Most closures are between the first robot and the last, and all of these are false.
  REQUIRE_FALSE(closures_between(*clean).contains({0, 4}));
  const auto count = closures_between(corrupted_graph(*clean, optimum_of(*clean), added, 1));
  for (const auto& [pair, closures] : count)
    if (pair != std::pair<std::size_t, std::size_t>(0, 4)) CHECK(closures < count.at({0, 4}));
  (void)check_false_closures(kSphere, 5, added, 1);
}

// Measured: 29, 26, 25 rounds with places of 2 closures, 46, 30, 28 with places of 10.
TEST_CASE("Many false closures that agree cost less than twice the rounds of few", "[pgo]") {
  // The sum of three seeds, because a single team may need one more session than another.
  std::uint32_t few = 0, many = 0;
  for (const unsigned seed : {1U, 2U, 3U}) {
    few += check_false_closures(kGarage, 3, {.places = kPlaces, .size = 2}, seed);
    many += check_false_closures(kGarage, 3, {.places = kPlaces, .size = 10}, seed);
  }
  CAPTURE(few, many);
  CHECK((many < 2 * few || few == 0));  // 0: no data
}

struct Certified {
  const char* name;
  double optimum;  // SE-Sync
  int rounds;      // largest number of rounds to a gap of 1e-6
};

TEST_CASE("A team that trusts its closures reaches the certified optimum", "[pgo]") {
  const auto [name, optimum, most] =
      GENERATE(values({Certified{"pose_graphs/3d/smallGrid3D.g2o", 1025.398056, 8},
                       Certified{kSphere, 1687.005815, 7}, Certified{kGarage, 1.26252443, 7},
                       Certified{"pose_graphs/3d/torus3D.g2o", 24227.04556, 7}}));
  CAPTURE(name);
  const auto graph = partitioned(name, 5);
  if (!graph) return;
  AskedTeam asked(*graph, chordal_initialisation(graph->poses(), graph->edges), kTrusting);
  int rounds = 0;
  while (cost_of_poses(*graph, asked.poses()) > optimum * (1.0 + 1e-6) && rounds <= most) {
    REQUIRE(asked.step());
    ++rounds;
  }
  CHECK(rounds <= most);
  REQUIRE(asked.run(60));
  const double cost = cost_of_poses(*graph, asked.poses());
  WARN(name << ": 1e-6 after " << rounds << " rounds, ends after " << asked.team().rounds()
            << " with " << cost / optimum - 1.0);
  CHECK(cost == Approx(optimum).epsilon(1e-7));
  CHECK(asked.team().state().cost == Approx(cost).epsilon(1e-9));
}

void check_shapes(const std::string& name, bool robust) {
  CAPTURE(name, robust);
  const auto graph = partitioned(name, 5);
  if (!graph) return;
  std::map<TeamShape, double> cost;
  for (const TeamShape shape : {TeamShape::kAll, TeamShape::kChain}) {
    AskedTeam asked(*graph, odometry_start(*graph), robust ? kExact : kTrusting, shape);
    REQUIRE(asked.run(100));
    cost[shape] = cost_of_poses(*graph, asked.poses());
  }
  CHECK(cost[TeamShape::kChain] == Approx(cost[TeamShape::kAll]).epsilon(1e-9));
}

// Bytes that the members of a graph as robots send in sessions.
std::size_t bytes_as_robots(const TeamGraph& graph, bool robust) {
  MemberTeam team(
      graph, 3, odometry_start(graph),
      [&](SessionGraph part, TreePlace place) {
        return std::make_unique<TreeNewton>(
            std::move(part), std::move(place),
            TreeNewtonOptions{.dimension = graph.dimension, .robust = robust});
      },
      TeamShape::kAll, true);
  RoundMeter meter(graph.robots(), {});
  while (team.rounds() < 200 && team.step(meter)) {
  }
  REQUIRE(team.done());
  CHECK(std::ranges::count(team.kept(), false) == 0);
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < graph.robots(); ++k) bytes += team.sent_by(k);
  return bytes;
}

// Measured: 0.99 with two robots, 1.2 with five. If the robots do not decide the closures inside
// them alone, second derivatives are sent in most rounds: 3.
TEST_CASE("Weighing true closures costs few bytes", "[pgo]") {
  const std::size_t robots = GENERATE(2U, 5U);
  const auto graph = partitioned(kSphere, robots);
  if (!graph) return;
  const auto weighed = static_cast<double>(bytes_as_robots(*graph, true));
  const auto trusted = static_cast<double>(bytes_as_robots(*graph, false));
  CAPTURE(robots, weighed, trusted);
  CHECK(weighed < 1.5 * trusted);
}

// The robots have drifted, and few closures join them. Robots that decide the closures inside them
// whatever these fit would lose four of the closures between them.
TEST_CASE("Robots that have drifted keep the few closures between them", "[pgo]") {
  const auto file = shared_data("cosmo_bench/ntu_r3_02_d02_n04_n13_wifi.jrl");
  if (!file) return;
  const TeamGraph graph = labelled_team(read_jrl(*file), file->string()).graph;
  MemberTeam team(
      graph, 3, odometry_start(graph),
      [](SessionGraph part, TreePlace place) {
        return std::make_unique<TreeNewton>(std::move(part), std::move(place),
                                            TreeNewtonOptions{.patience_rounds = 8.0});
      },
      TeamShape::kAll, true);
  RoundMeter meter(graph.robots(), {});
  while (team.rounds() < 200 && team.step(meter)) {
  }
  REQUIRE(team.done());
  const std::vector<bool> kept = team.kept();
  for (std::size_t k = 0; k < kept.size(); ++k)
    if (graph.robot_of(graph.edges[k].i) != graph.robot_of(graph.edges[k].j)) CHECK(kept[k]);
}

TEST_CASE("A solver message goes to one neighbour in the tree", "[pgo]") {
  const TeamShape shape = GENERATE(TeamShape::kAll, TeamShape::kChain);
  std::mt19937 rng(3);
  const TeamGraph graph = noisy_chain(60, 4, 0.01, rng);
  AskedTeam asked(graph, odometry_start(graph), {}, shape);
  REQUIRE(asked.run(100));
  CHECK(asked.misaddressed() == 0);
  std::size_t sent = 0, received = 0;
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    sent += asked.team().sent_by(k);
    received += asked.team().received_by(k);
  }
  CHECK(received == sent);
  std::set<KeyframeId> announced;
  for (std::size_t k = 0; k < graph.robots(); ++k)
    for (const PoseEdge& e : part_of(graph, k).between) announced.insert({e.from, e.to});
  // Public poses go to all other robots. As a broadcast each counts once.
  const std::size_t poses = announced.size() * (7 * sizeof(float) + 2);
  CHECK(sent == asked.message_bytes() + (graph.robots() - 1) * poses);
  CHECK(asked.counted_bytes() == asked.message_bytes() + poses);
}

// Checks that one of the two robots of a closure decides it, and that all verdicts agree.
void check_decided_once(const AskedTeam& asked, const TeamGraph& graph) {
  std::map<ClosureId, int> undecided;  // parallel closures have separate verdicts
  std::map<ClosureId, std::set<bool>> verdicts;
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    const SessionGraph part = part_of(graph, k);
    for (std::size_t e = part.odometry; e < part.own.size(); ++e) ++undecided[part.own[e].id()];
    for (const PoseEdge& e : part.between)
      if (e.other(part.self).robot > part.self && !part.trusted.contains(e.id()))
        ++undecided[e.id()];
  }
  std::set<ClosureId> parallel;
  for (const auto& [id, count] : undecided)
    if (count > 1) parallel.insert(id);
  for (std::size_t k = 0; k < graph.robots(); ++k)
    for (const WeighedClosure& c : asked.member(k).verdicts().closures) {
      --undecided[c.id];
      verdicts[c.id].insert(c.kept);
    }
  std::size_t not_once = 0, contradictory = 0;
  for (const ClosureId& id : parallel) verdicts.erase(id);
  for (const auto& [id, count] : undecided) not_once += count != 0 ? 1 : 0;
  for (const auto& [id, given] : verdicts) contradictory += given.size() > 1 ? 1 : 0;
  CHECK(not_once == 0);
  CHECK(contradictory == 0);
}

TEST_CASE("Every closure is decided by exactly one of its two robots", "[pgo]") {
  const auto clean = partitioned("pose_graphs/3d/smallGrid3D.g2o", 4);
  if (!clean) return;
  const std::vector<SE3> truth = optimum_of(*clean);
  Corrupter corrupter(*clean, truth, 4);
  corrupter.add_random(GENERATE(0.1, 0.8));
  AskedTeam asked(corrupter.graph(), odometry_start(corrupter.graph()), kExact);
  REQUIRE(asked.run(100));
  check_decided_once(asked, corrupter.graph());
}

// Number of groups of robots that kept edges connect.
std::size_t groups_of(const TeamGraph& graph, const std::vector<bool>& kept) {
  std::vector<std::size_t> group(graph.robots());
  for (std::size_t k = 0; k < group.size(); ++k) group[k] = k;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (!kept[k]) continue;
    const std::size_t a = group[graph.robot_of(graph.edges[k].i)];
    const std::size_t b = group[graph.robot_of(graph.edges[k].j)];
    std::replace(group.begin(), group.end(), a, b);
  }
  return std::set<std::size_t>(group.begin(), group.end()).size();
}

TEST_CASE("The robots of the tunnels estimate their noise and reach one frame", "[pgo]") {
  const TeamShape shape = GENERATE(TeamShape::kAll, TeamShape::kChain);
  const auto folder = shared_data("multi_robot/tunnels_8robots");
  if (!folder) return;
  const TeamGraph graph = read_team_folder(*folder);
  AskedTeam asked(graph, odometry_start(graph), {}, shape);
  const bool ended = asked.run(200);
  const std::vector<bool> kept = asked.team().kept();
  const std::vector<bool> odometry = odometry_edges(graph);
  const std::vector<SE3> poses = asked.poses();
  std::map<std::pair<Index, Index>, int> edges_between;
  for (const BlockEdge& e : graph.edges) ++edges_between[std::minmax(e.i, e.j)];
  std::size_t closures = 0, all = 0;
  double largest = 0.0;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (odometry[k]) continue;
    ++all;
    if (!kept[k]) continue;
    ++closures;
    const BlockEdge& e = graph.edges[k];
    // Verdicts are by pair of poses, so they do not show which of several parallel closures is
    // kept.
    if (edges_between.at(std::minmax(e.i, e.j)) > 1) continue;
    const auto [self, peer] = std::minmax({graph.robot_of(e.i), graph.robot_of(e.j)});
    const double factor = asked.member(self).noise().pairs.at(static_cast<RobotId>(peer)).factor;
    const PoseEdge edge{{0, 0}, {0, 1}, e.T_i_j, {e.kappa, e.tau}};
    largest = std::max(largest, residual_of(edge, poses[static_cast<std::size_t>(e.i)],
                                            poses[static_cast<std::size_t>(e.j)]) /
                                    factor);
  }
  const SolverState& state = asked.team().state();
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < graph.robots(); ++k) bytes += asked.team().received_by(k);
  WARN("tunnels: kept " << closures << " of " << all << ", noise scale " << state.noise_scale
                        << ", barc " << state.barc << ", largest residual " << largest << ", "
                        << asked.team().rounds() << " rounds, cost " << state.cost << ", "
                        << 1e-6 * static_cast<double>(bytes) << " MB received");
  CHECK(ended);
  CHECK(asked.team().rounds() <= 100);
  CHECK(closures >= 2500);
  CHECK(closures <= 3000);
  CHECK(state.noise_scale > 3.0);
  CHECK(state.noise_scale < 5.0);
  CHECK(groups_of(graph, kept) == 1);
  CHECK(largest <= 1.01 * state.barc);  // all kept closures fit in one frame
  check_decided_once(asked, graph);
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    CHECK(asked.member(k).state().cost == state.cost);
    CHECK(asked.member(k).state().round == state.round);
  }
}

}  // namespace
}  // namespace km
