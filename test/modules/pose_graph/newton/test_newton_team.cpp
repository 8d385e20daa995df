#include <algorithm>
#include <catch2/catch.hpp>

#include "modules/core/lie.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/newton/newton_team.hpp"
#include "modules/pose_graph/team/team_graph_file.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

// A noisy grid walked row by row, dealt out in equal runs; dimension 2: planar.
TeamGraph grid(std::mt19937& rng, int side, std::size_t robots, int dimension, double noise) {
  const auto motion = [&](double size) {
    Vector6 xi = size * random_vector<6>(rng);
    if (dimension == 2) xi(0) = xi(1) = xi(5) = 0.0;
    return xi;
  };
  std::vector<SE3> truth;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      Vector6 turn = motion(1.0);
      turn.tail<3>().setZero();
      truth.push_back(SE3(Eigen::Translation3d(x, y, 0.0)) * se3_exp(turn));
    }
  TeamGraph graph{.dimension = dimension};
  const int n = side * side;
  for (std::size_t k = 0; k <= robots; ++k)
    graph.first.push_back(static_cast<Eigen::Index>(k) * n / static_cast<Eigen::Index>(robots));
  for (int i = 0; i < n; ++i)
    for (const int step : {1, side})
      if (i + step < n) {
        const SE3 T = truth[static_cast<std::size_t>(i)].inverse() *
                      truth[static_cast<std::size_t>(i + step)] * se3_exp(motion(noise));
        graph.edges.push_back({i, i + step, T, 3.0, 2.0});
      }
  return graph;
}

LiftedPoses chordal_start(const TeamGraph& graph, Eigen::Index rank = 5) {
  return lift(chordal_initialisation(graph.poses(), graph.edges), rank);
}

std::vector<SE3> poses_of(const NewtonTeam& team, std::size_t robots) {
  std::vector<SE3> poses;
  for (std::size_t k = 0; k < robots; ++k)
    poses.insert(poses.end(), team.agent(k).poses().begin(), team.agent(k).poses().end());
  return poses;
}

double cost_of(const TeamGraph& graph, const std::vector<SE3>& poses) {
  return QuadraticProblem(3, graph.poses(), graph.edges, {}).cost(lift(poses, 3));
}

// Runs the team to its end; the number of rounds.
int solve(NewtonTeam& team, std::size_t robots) {
  RoundMeter meter(robots, {});
  int rounds = 0;
  while (rounds < 100 && team.step(meter)) ++rounds;
  return rounds;
}

// H and g of the whole graph, dense.
std::pair<Eigen::MatrixXd, Eigen::VectorXd> newton_equations(const TeamGraph& graph,
                                                             const std::vector<SE3>& poses,
                                                             Curvature curvature) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6 * graph.poses(), 6 * graph.poses());
  Eigen::VectorXd g = Eigen::VectorXd::Zero(6 * graph.poses());
  for (const BlockEdge& e : graph.edges) {
    const EdgeModel model = model_edge(e, poses[static_cast<std::size_t>(e.i)],
                                       poses[static_cast<std::size_t>(e.j)], curvature);
    H.block<6, 6>(6 * e.i, 6 * e.i) += model.H_ii;
    H.block<6, 6>(6 * e.j, 6 * e.j) += model.H_jj;
    H.block<6, 6>(6 * e.i, 6 * e.j) += model.H_ij;
    H.block<6, 6>(6 * e.j, 6 * e.i) += model.H_ij.transpose();
    g.segment<6>(6 * e.i) += model.g_i;
    g.segment<6>(6 * e.j) += model.g_j;
  }
  return {H, g};
}

}  // namespace

TEST_CASE("a round of the team is an exact Newton step of the whole graph", "[newton]") {
  const std::size_t robots = GENERATE(1U, 2U, 4U, 9U);
  const int dimension = GENERATE(2, 3);
  CAPTURE(robots, dimension);
  std::mt19937 rng(3);
  const TeamGraph graph = grid(rng, 6, robots, dimension, 0.1);
  const LiftedPoses start = chordal_start(graph, 3);
  NewtonTeam team(graph, 3, start, {});
  const std::vector<SE3> before = poses_of(team, robots);
  RoundMeter meter(robots, {});
  for (int round = 0; round < 4; ++round) team.step(meter);
  const std::vector<SE3> after = poses_of(team, robots);

  const auto [H, g] = newton_equations(graph, before, Curvature::kGaussNewton);
  Eigen::VectorXd step(6 * graph.poses());
  for (std::size_t k = 0; k < before.size(); ++k) {
    const Eigen::Matrix3d R_t = before[k].linear().transpose();
    step.segment<6>(6 * static_cast<Eigen::Index>(k)) << so3_log(R_t * after[k].linear()),
        R_t * (after[k].translation() - before[k].translation());
  }
  REQUIRE(step.norm() > 1e-3);
  // Edges between kept poses are told in single precision.
  CHECK((H * step + g).norm() < 1e-5 * g.norm());
}

TEST_CASE("the team ends at a minimum, the cost never rising", "[newton]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  const double disorder = GENERATE(0.0, 0.3, 1.5);  // of the start's poses [rad, m]
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, disorder, dimension);
  std::mt19937 rng(seed);
  const TeamGraph graph = grid(rng, 6, 4, dimension, 0.1);
  std::vector<SE3> start = chordal_initialisation(graph.poses(), graph.edges);
  for (SE3& T : start) {
    Vector6 xi = disorder * random_vector<6>(rng);
    if (dimension == 2) xi(0) = xi(1) = xi(5) = 0.0;
    T = T * se3_exp(xi);
  }
  NewtonTeam team(graph, 5, lift(start, 5), {});
  const auto rounds = run_team(graph, team, {.max_rounds = 300}, {});
  for (std::size_t k = 1; k < rounds.size(); ++k)
    CHECK(rounds[k].cost <= rounds[k - 1].cost * (1.0 + 1e-12));
  CHECK(rounds.size() < 300);
  // A decrease of 1e-13 of the cost is left at most; the gradient's square bounds it from below
  // with the largest curvature, some hundreds here.
  CHECK(rounds.back().gradient_norm < std::sqrt(1e-13 * rounds.back().cost * 2e3));
  CHECK(*team.agent(0).cost() == Approx(rounds.back().cost).epsilon(1e-12));
}

TEST_CASE("the decrease to come is known far below the rounding of the cost", "[newton]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TeamGraph graph = grid(rng, 6, 4, 3, 0.1);
  // Each robot's gradient is large at its separators; only their sum vanishes.
  NewtonTeam team(graph, 3, chordal_start(graph, 3), {.tolerance = 1e-22});
  CHECK(solve(team, 4) < 40);
  CHECK(team.agent(0).done());
  CHECK(team.agent(0).decrement() >= 0.0);
  CHECK(team.agent(0).decrement() <= 2e-22 * *team.agent(0).cost());
}

TEST_CASE("the team finds its own start as the chordal initialisation", "[newton]") {
  const int dimension = GENERATE(2, 3);
  CAPTURE(dimension);
  std::mt19937 rng(5);
  const TeamGraph graph = grid(rng, 6, 3, dimension, 0.1);
  NewtonTeam given(graph, 3, chordal_start(graph, 3), {});
  NewtonTeam alone(graph, 3, {}, {});
  const int rounds = solve(given, 3);
  CHECK(solve(alone, 3) <= rounds + 4);
  CHECK(*alone.agent(0).cost() == Approx(*given.agent(0).cost()).epsilon(1e-8));

  const TeamGraph exact = grid(rng, 6, 3, dimension, 0.0);
  NewtonTeam team(exact, 3, {}, {});
  solve(team, 3);
  CHECK(cost_of(exact, poses_of(team, 3)) < 1e-20);
}

TEST_CASE("the result does not depend on the frame or on who is which robot", "[newton]") {
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TeamGraph graph = grid(rng, 6, 4, 3, 0.1);
  const std::vector<SE3> start = chordal_initialisation(graph.poses(), graph.edges);
  const SE3 T_other_world = random_pose(rng);
  std::vector<SE3> moved;
  for (const SE3& T : start) moved.push_back(T_other_world * T);
  NewtonTeam first(graph, 3, lift(start, 3), {});
  NewtonTeam second(graph, 3, lift(moved, 3), {});
  solve(first, 4);
  solve(second, 4);
  const auto a = poses_of(first, 4);
  const auto b = poses_of(second, 4);
  for (std::size_t k = 0; k < a.size(); ++k) CHECK(b[k].isApprox(T_other_world * a[k], 1e-9));

  // Robot 3 first, robot 0 last: other poses are separators, and another one is held fixed.
  const Eigen::Index n = graph.poses();
  TeamGraph turned{.dimension = 3};
  for (auto f = graph.first.rbegin(); f != graph.first.rend(); ++f) turned.first.push_back(n - *f);
  for (BlockEdge e : graph.edges) {
    e.i = n - 1 - e.i;
    e.j = n - 1 - e.j;
    turned.edges.push_back(e);
  }
  std::vector<SE3> backwards(start.rbegin(), start.rend());
  NewtonTeam third(turned, 3, lift(backwards, 3), {});
  solve(third, 4);
  const auto c = poses_of(third, 4);
  CHECK(*third.agent(0).cost() == Approx(*first.agent(0).cost()).epsilon(1e-9));
  const SE3 T_a_c = a.front() * c.back().inverse();
  // Both end within 1e-13 of the least cost: its square root, amplified, in the poses.
  for (std::size_t k = 0; k < a.size(); ++k)
    CHECK((T_a_c * c[a.size() - 1 - k]).isApprox(a[k], 1e-4));
}

TEST_CASE("the result does not depend on the order of messages", "[newton]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TeamGraph graph = grid(rng, 5, 4, 3, 0.1);
  NewtonTeam ordered(graph, 3, {}, {});
  solve(ordered, 4);

  std::set<RobotId> everyone{0, 1, 2, 3};
  std::vector<NewtonAgent> agents;
  for (RobotId k = 0; k < 4; ++k) {
    RobotPart part = part_of(graph, k);
    agents.emplace_back(RobotEdges{k, part.poses, part.own_edges, part.edges_to}, everyone, 3,
                        NewtonOptions{});
  }
  // What is on its way to one robot; some of it arrives twice.
  struct Mail {
    std::size_t to;
    std::shared_ptr<const NewtonShare> share;
    NewtonHello hello;
  };
  std::vector<Mail> mail;
  for (const NewtonAgent& sender : agents)
    for (std::size_t to = 0; to < 4; ++to) mail.push_back({to, nullptr, sender.hello()});
  while (!mail.empty()) {
    const auto next = std::uniform_int_distribution<std::size_t>(0, mail.size() - 1)(rng);
    const Mail letter = mail[next];
    if (std::bernoulli_distribution(0.8)(rng))
      mail.erase(mail.begin() + static_cast<std::ptrdiff_t>(next));
    if (letter.share)
      agents[letter.to].receive(letter.share);
    else
      agents[letter.to].receive(letter.hello);
    if (auto share = agents[letter.to].advance()) {
      const auto sent = std::make_shared<const NewtonShare>(std::move(*share));
      for (std::size_t to = 0; to < 4; ++to) mail.push_back({to, sent, {}});
    }
  }
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(agents[k].done());
    REQUIRE(agents[k].poses().size() == ordered.agent(k).poses().size());
    for (std::size_t i = 0; i < agents[k].poses().size(); ++i)
      CHECK(agents[k].poses()[i].matrix() == ordered.agent(k).poses()[i].matrix());
  }
}

TEST_CASE("when a robot leaves, the others end with what the team agreed on", "[newton]") {
  std::mt19937 rng(1);
  const TeamGraph graph = grid(rng, 5, 3, 3, 0.1);
  NewtonTeam team(graph, 3, chordal_start(graph, 3), {});
  RoundMeter meter(3, {});
  for (int round = 0; round < 4; ++round) team.step(meter);
  NewtonAgent agent = team.agent(0);
  REQUIRE(agent.ready());
  const std::vector<SE3> held = agent.poses();
  agent.leave(7);
  CHECK_FALSE(agent.done());
  agent.leave(2);
  CHECK(agent.done());
  CHECK_FALSE(agent.advance());
  REQUIRE(agent.poses().size() == held.size());
  CHECK(std::equal(held.begin(), held.end(), agent.poses().begin(),
                   [](const SE3& a, const SE3& b) { return a.matrix() == b.matrix(); }));
}

TEST_CASE("graphs that cannot be solved are refused", "[newton]") {
  std::mt19937 rng(1);
  TeamGraph graph = grid(rng, 4, 2, 3, 0.1);
  const LiftedPoses start = chordal_start(graph, 3);
  CHECK_THROWS_AS(NewtonTeam(graph, 2, {}, {}), std::invalid_argument);
  CHECK_THROWS_AS(NewtonTeam(graph, 5, start, {}), std::invalid_argument);
  TeamGraph apart = graph;
  std::erase_if(apart.edges, [](const BlockEdge& e) { return e.i == 0; });
  CHECK_THROWS_AS(NewtonTeam(apart, 3, {}, {}), std::invalid_argument);
  // The agents are not told of the edges between the robots.
  RobotPart part = part_of(graph, 0);
  NewtonAgent alone(RobotEdges{0, part.poses, part.own_edges, {}}, {0, 1}, 3, {});
  alone.receive(alone.hello());
  alone.receive(NewtonHello{.robot = 1});
  CHECK_THROWS_AS(alone.advance(), std::runtime_error);

  part.own_edges.front().kappa = 0.0;
  NewtonAgent broken(RobotEdges{0, part.poses, part.own_edges, {}}, {0}, 3, {});
  broken.receive(broken.hello());
  CHECK_THROWS_AS(broken.advance(), std::invalid_argument);
}

TEST_CASE("five robots reach the certified optimum of public graphs", "[newton]") {
  struct Known {
    const char* file;
    double optimum;  // of SE-Sync, certified
  };
  const auto known = GENERATE(Known{"3d/smallGrid3D.g2o", 1025.39802},
                              Known{"2d/intel.g2o", 52.3482273}, Known{"2d/MIT.g2o", 61.1541155});
  CAPTURE(known.file);
  const auto file = shared_data(std::string("pose_graphs/") + known.file);
  if (!file) return;
  const TeamGraph graph = deal_contiguously(read_g2o(*file), 5, file->string());
  NewtonTeam team(graph, 5, chordal_start(graph), {});
  const auto rounds = run_team(graph, team, {.max_rounds = 100}, {});
  // Files round their quaternions: below 1e-7 costs cannot be compared.
  CHECK(rounds.back().cost == Approx(known.optimum).epsilon(1e-7));
  CHECK(rounds.size() <= 15);
}

}  // namespace km
