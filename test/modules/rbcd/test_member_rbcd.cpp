#include "modules/rbcd/member_rbcd.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/solver_team.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

SolverTeam rbcd_team(const TeamProblem& problem, const TeamTree& tree,
                     const RbcdOptions& options = {}, const TransportFaults& faults = {}) {
  return solver_team(problem, tree, faults, [&](SessionGraph graph, const TreePlace& place) {
    return std::make_unique<MemberRbcd>(std::move(graph), place, options);
  });
}

constexpr TransportFaults kRoughTransport{.max_delay = 7, .duplicated = 0.3, .seed = 3};

// Above the error of single precision in messages, below any error of the method.
constexpr double kGap = 2e-6;

TeamProblem three_robots(double tilt_sigma = 0.0) {
  return random_team_problem(
      {.robots = {2, 5, 7}, .pairs = {{2, 5}, {5, 7}}, .keyframes = 15, .tilt_sigma = tilt_sigma},
      4);
}

double gap_of(const TeamProblem& problem, const TeamPoses& poses) {
  const CentralProblem central(problem);
  const double optimum = central.optimum(poses);
  CHECK(central.optimum(problem.start) == Approx(optimum).epsilon(1e-9));
  return (central.cost(poses) - optimum) / optimum;
}

}  // namespace

TEST_CASE("Block descent of a team ends at the optimum of the whole graph") {
  const auto [name, robots] = GENERATE(table<std::string, std::size_t>({{"tinyGrid3D", 2},
                                                                        {"tinyGrid3D", 3},
                                                                        {"smallGrid3D", 2},
                                                                        {"smallGrid3D", 3},
                                                                        {"smallGrid3D", 5}}));
  const bool rough = GENERATE(false, true);
  CAPTURE(name, robots, rough);
  const auto file = shared_data("pose_graphs/3d/" + name + ".g2o");
  if (!file) return;
  const TeamProblem problem = deal_file(*file, robots);
  const TeamTree tree = rough ? chain(problem.members()) : star(problem.members());
  SolverTeam team = rbcd_team(problem, tree, {}, rough ? kRoughTransport : TransportFaults());
  REQUIRE(team.run());
  CHECK(team.refused() == 0);
  CHECK(gap_of(problem, team.poses()) < kGap);
  const SolverState state = team.member(problem.members()[0]).state();
  CHECK(state.cost == Approx(CentralProblem(problem).cost(team.poses())).epsilon(1e-4));
  CAPTURE(state.round);
  CHECK(state.round < 200);
}

TEST_CASE("The result depends neither on the order of messages nor on the tree") {
  const TeamProblem problem = three_robots();
  SolverTeam calm = rbcd_team(problem, star(problem.members(), 1));
  SolverTeam rough = rbcd_team(problem, chain(problem.members()), {}, kRoughTransport);
  REQUIRE(calm.run());
  REQUIRE(rough.run());
  for (const RobotId robot : problem.members())
    for (std::size_t i = 0; i < problem.start.at(robot).size(); ++i)
      CHECK(calm.member(robot).poses()[i].matrix() == rough.member(robot).poses()[i].matrix());
}

TEST_CASE("Block descent ends upright if the robots have verticals") {
  const TeamProblem problem = three_robots(0.01);
  SolverTeam team = rbcd_team(problem, star(problem.members()));
  REQUIRE(team.run());
  CHECK(gap_of(problem, team.poses()) < kGap);
}

TEST_CASE("Poses of an absent robot hold the frame and do not move") {
  TeamProblem problem = three_robots();
  problem.absent = {2};
  // The root has no edge to the absent robot. The held poses fit badly, so that descent takes long.
  SolverTeam team = rbcd_team(problem, star(problem.members(), 1), {.min_relative_decrease = 1e-9});
  REQUIRE(team.run());
  CHECK(gap_of(problem, team.poses()) < kGap);
}

TEST_CASE("A rejected closure has no influence") {
  TeamProblem problem = three_robots();
  const double optimum = CentralProblem(problem).optimum(problem.start);
  for (const KeyframeId& to : {KeyframeId{5, 14}, KeyframeId{2, 11}}) {
    PoseEdge wrong{{2, 1}, to, SE3::Identity(), {1e4, 1e4}};
    wrong.T_from_to.translation().x() = 30.0;
    problem.edges.push_back(wrong);
    problem.decided[wrong.id()] = false;
  }
  problem.edges = in_order(problem.edges);
  SolverTeam team = rbcd_team(problem, star(problem.members()));
  REQUIRE(team.run());
  CHECK(gap_of(problem, team.poses()) < kGap);
  CHECK(CentralProblem(problem).cost(team.poses()) < optimum + 40.0);
}

TEST_CASE("Descent stops after the rounds it is given, with a better state") {
  const TeamProblem problem = three_robots();
  const CentralProblem central(problem);
  SolverTeam team = rbcd_team(problem, star(problem.members()), {.max_rounds = 3});
  REQUIRE(team.run());
  for (const RobotId robot : problem.members()) CHECK(team.member(robot).state().round == 3);
  CHECK(central.cost(team.poses()) < 0.1 * central.cost(problem.start));
}

TEST_CASE("Every member passes through every state that the root reports, in order") {
  constexpr int kShare = 1, kProgress = 2;  // first bytes of messages
  const int held_back = GENERATE_COPY(kShare, kProgress);
  CAPTURE(held_back);
  const TeamProblem problem =
      random_team_problem({.robots = {2, 5}, .pairs = {{2, 5}}, .keyframes = 15}, 4);
  const TeamTree tree = star(problem.members());
  MemberRbcd root(session_graph(problem, 2), tree.at(2), {.min_relative_decrease = 0.0});
  MemberRbcd leaf(session_graph(problem, 5), tree.at(5), {.min_relative_decrease = 0.0});
  std::vector<std::uint32_t> rounds{0};  // rounds of the member whose messages are delayed
  MemberRbcd& late = held_back == kShare ? root : leaf;
  const RobotId from = held_back == kShare ? 5 : 2;
  std::vector<SolverMessage> held;
  const auto carry = [&](MemberRbcd& member, MemberRbcd& to) {
    const RobotId sender = &member == &root ? 2 : 5;
    for (SolverMessage& message : member.advance())
      if (message.bytes->front() == held_back)
        held.push_back(std::move(message));
      else
        CHECK(to.receive(sender, *message.bytes));
  };
  const std::size_t enough = held_back == kShare ? 17 : 3;  // 16 rounds; a report every 5
  for (int n = 0; n < 100 && held.size() < enough; ++n) {
    carry(root, leaf);
    carry(leaf, root);
  }
  REQUIRE(held.size() >= enough);
  const auto note = [&] {
    if (rounds.back() != late.state().round) rounds.push_back(late.state().round);
  };
  std::reverse(held.begin(), held.end());
  for (const SolverMessage& message : held) {
    CHECK(late.receive(from, *message.bytes));
    note();
  }
  for (int n = 0; n < 20 && late.ready(); ++n) {
    (void)late.advance();
    note();
  }
  REQUIRE(rounds.size() >= 4);
  rounds.resize(4);
  CHECK(rounds == std::vector<std::uint32_t>{0, 5, 10, 15});
}

TEST_CASE("Impossible messages are refused") {
  const TeamProblem problem = three_robots();
  const TeamTree tree = star(problem.members(), 1);
  MemberRbcd root(session_graph(problem, 5), tree.at(5), {});
  MemberRbcd leaf(session_graph(problem, 2), tree.at(2), {});
  const std::vector<SolverMessage> messages = leaf.advance();
  REQUIRE(messages.size() == 3);  // shares of rounds 0 and 1, poses
  const TeamPoses before{{5, root.poses()}};
  for (const SolverMessage& message : messages) {
    CHECK(message.to == 5);
    std::vector<std::uint8_t> bytes = *message.bytes;
    CHECK_FALSE(root.receive(4, bytes));  // not a member
    CHECK_FALSE(root.receive(5, bytes));  // itself
    CHECK_FALSE(leaf.receive(7, bytes));  // neither root nor neighbour
    for (std::size_t size = 0; size < bytes.size(); ++size)
      CHECK_FALSE(root.receive(2, std::span(bytes).first(size)));
    bytes.push_back(0);
    CHECK_FALSE(root.receive(2, bytes));
    bytes.pop_back();
    bytes[0] = 9;
    CHECK_FALSE(root.receive(2, bytes));
    bytes[0] = message.bytes->front();
    bytes[1] = 100;  // a round beyond the present one
    CHECK_FALSE(root.receive(2, bytes));
    std::fill(bytes.begin() + 2, bytes.end(), std::uint8_t{0xff});  // not numbers
    bytes[1] = 1;
    CHECK_FALSE(root.receive(2, bytes));
    CHECK(root.receive(2, *message.bytes));
    CHECK(root.receive(2, *message.bytes));
  }
}

}  // namespace km
