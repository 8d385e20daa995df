#include "modules/core/geometry/lie.hpp"
#include "modules/robust/pair_consensus.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kTolerance = 1e-6;  // relative; single precision

// Pairs of robots that are displaced by `moved` from their true place. The closures of the pairs
// give the true place, up to their spread.
PairMotions pairs_of(const std::map<RobotId, SE3>& moved) {
  PairMotions pairs;
  for (const auto& [a, T_a] : moved)
    for (const auto& [b, T_b] : moved)
      if (a < b)
        pairs[{a, b}] = {.T = SinglePose::of(T_a * T_b.inverse()),
                         .centre = {1.0 * a, 2.0 * b, 0.0},
                         .radius_m = 5.0,
                         .spread_m = 0.1,
                         .consistent_m = 1.0};
  return pairs;
}

PairMotions of_four() {
  const SE3 still = SE3::Identity();
  return pairs_of({{1, still}, {2, still}, {3, still}, {4, still}});
}

SE3 shifted(double x_m) {
  return make_pose(Eigen::Matrix3d::Identity(), {x_m, 0.0, 0.0});
}

}  // namespace

TEST_CASE("pairs of the other robots move robots that one of four has misplaced") {
  const RobotId liar = GENERATE(as<RobotId>(), 1, 2, 3, 4);
  const double lie_m = GENERATE(5.0, 1000.0);
  CAPTURE(liar, lie_m);
  std::mt19937 rng(7);
  std::map<RobotId, SE3> moved;
  for (RobotId robot = 1; robot <= 4; ++robot)
    moved[robot] = robot == liar ? SE3::Identity() : random_pose(rng, lie_m);
  PairMotions pairs = pairs_of(moved);
  for (auto& [robots, pair] : pairs)  // closures of the misbehaving robot fit the present places
    if (robots.first == liar || robots.second == liar) pair.T = {};
  const std::map<RobotId, SE3> moves = common_placement(pairs);
  REQUIRE(moves.size() == 4);
  for (const auto& [robots, pair] : pairs) {
    if (robots.first == liar || robots.second == liar) continue;
    const SE3 left = moves.at(robots.second).inverse() * moves.at(robots.first) * pair.T.pose();
    CHECK(left.isApprox(SE3::Identity(), kTolerance * lie_m));
  }
}

TEST_CASE("pairs with inconsistent closures have no vote") {
  PairMotions pairs = pairs_of(
      {{1, SE3::Identity()}, {2, shifted(50.0)}, {3, shifted(-50.0)}, {4, SE3::Identity()}});
  for (auto& [robots, pair] : pairs) pair.strength = {1.0, 1.0};
  CHECK(usual_strength(pairs).tau < kUnlimited.tau);
  for (auto& [robots, pair] : pairs)
    if (robots.first != 1) pair.spread_m = 1.1 * pair.consistent_m;
  CHECK(usual_strength(pairs).tau == kUnlimited.tau);
}

TEST_CASE("robots placed by a pair without a vote move to the place given by other pairs") {
  PairMotions pairs = pairs_of({{1, SE3::Identity()}, {2, shifted(50.0)}, {3, SE3::Identity()}});
  pairs[{1, 3}].T = SinglePose::of(shifted(20.0));
  pairs[{1, 3}].spread_m = 2.0 * pairs[{1, 3}].consistent_m;
  const std::map<RobotId, SE3> moves = common_placement(pairs);
  REQUIRE(moves.size() == 3);
  CHECK(moves.at(1).isApprox(SE3::Identity()));
  CHECK(moves.at(2).isApprox(shifted(-50.0)));
  CHECK(moves.at(3).isApprox(SE3::Identity()));
}

TEST_CASE("one robot of four cannot change the usual strength of pairs") {
  const RobotId liar = GENERATE(as<RobotId>(), 1, 2, 3, 4);
  const double lie = GENERATE(0.0, 1e-9, 1e9);
  CAPTURE(liar, lie);
  PairMotions pairs = of_four();
  double honest = 10.0;
  for (auto& [robots, pair] : pairs) {
    const bool lies = robots.first == liar || robots.second == liar;
    pair.strength = lies ? Precision{lie, lie} : Precision{honest, 100.0 / honest};
    if (!lies) honest += 1.0;
  }
  const Precision usual = usual_strength(pairs);
  CHECK(usual.kappa >= 10.0);
  CHECK(usual.kappa <= 12.0);
  CHECK(usual.tau >= 100.0 / 12.0);
  CHECK(usual.tau <= 10.0);
}

TEST_CASE("pairs are not limited if no robot can be outvoted") {
  PairMotions pairs = of_four();
  for (auto& [robots, pair] : pairs) pair.strength = {1.0, 1.0};
  CHECK(usual_strength(pairs).tau == 1.0);
  SECTION("a team of three") {
    std::erase_if(pairs, [](const auto& entry) { return entry.first.second == 4; });
  }
  SECTION("pairs form no loop") {
    std::erase_if(pairs, [](const auto& entry) { return entry.first.first != 1; });
  }
  SECTION("all pairs contradict each other") {
    std::erase_if(pairs, [](const auto& entry) { return entry.first.first != 1; });
    pairs[{2, 3}] = {.T = SinglePose::of(shifted(50.0)),
                     .spread_m = 0.1,
                     .consistent_m = 1.0,
                     .strength = {1.0, 1.0}};
  }
  SECTION("no team") {
    pairs.clear();
  }
  CHECK(usual_strength(pairs).kappa == kUnlimited.kappa);
  CHECK(usual_strength(pairs).tau == kUnlimited.tau);
}

TEST_CASE("robots that find their odometry noisy do not limit the others") {
  constexpr Precision kStep{2e4, 1e4}, kClosure{2e3, 1e3};
  const double factor = 20.0, weight = 1.0 / (factor * factor);
  SessionGraph graph{.own = {{{1, 0}, {1, 1}, SE3::Identity(), kStep}},
                     .odometry = 1,
                     .between = {{{0, 0}, {1, 1}, SE3::Identity(), kClosure}}};
  graph.self = 1;
  for (RobotId robot = 0; robot < 4; ++robot) {
    const double noise = robot % 2 == 0 ? weight : 1.0;
    graph.step_precision[robot] = {noise * kStep.kappa, noise * kStep.tau};
    graph.odometry_precision[robot] = {noise, noise};
  }
  limit_precisions(graph);
  CHECK(graph.own[0].precision.tau == kStep.tau);
  CHECK(graph.between[0].precision.kappa == kClosure.kappa);
  // A robot that claims ten times the precision of the others is limited, although it reports
  // noise.
  graph.step_precision[1] = kStep;
  graph.odometry_precision[1] = {0.01, 0.01};
  limit_precisions(graph);
  CHECK(graph.own[0].precision.tau == Approx(0.0125 * kStep.tau));
}

TEST_CASE("the motion of a pair is the one on which most closures agree") {
  std::mt19937 rng(3);
  const SE3 T = random_pose(rng, 30.0);
  const SE3 off = make_pose(Eigen::Matrix3d::Identity(), {0.0, 60.0, 0.0});
  std::map<KeyframeId, SE3> poses;
  std::vector<PoseEdge> closures;
  for (KeyframeIndex k = 0; k < 30; ++k) {
    const SE3 a = poses[{2, k}] = random_pose(rng);
    const SE3 b = poses[{5, k}] = random_pose(rng);
    const SE3 T_a_b = a.inverse() * (k % 3 == 0 ? off * T : T) * b;
    closures.push_back(k % 2 == 0 ? PoseEdge{{2, k}, {5, k}, T_a_b, {2.0, 3.0}}
                                  : PoseEdge{{5, k}, {2, k}, T_a_b.inverse(), {4.0, 5.0}});
  }
  const auto motion =
      motion_of_pair(closures, 2, [&](const KeyframeId& id) { return poses.at(id); });
  REQUIRE(motion);
  CHECK(motion->T.pose().isApprox(T, kTolerance));
  CHECK(motion->spread_m < 1e-9);
  CHECK(motion->strength.kappa == Approx(15 * 2.0 + 15 * 4.0));
  CHECK(motion->strength.tau == Approx(15 * 3.0 + 15 * 5.0));
  CHECK_FALSE(motion_of_pair({}, 2, [](const KeyframeId&) { return SE3::Identity(); }));
}

TEST_CASE("third robots decide between two motions of a pair with nearly equal votes") {
  const SE3 still = SE3::Identity();
  PairMotions pairs = pairs_of({{1, still}, {2, still}, {3, still}});
  pairs[{1, 3}].rival = pairs[{1, 3}].T;
  pairs[{1, 3}].rival_centre = pairs[{1, 3}].centre;
  pairs[{1, 3}].T = SinglePose::of(shifted(20.0));
  pairs[{1, 3}].votes = 8.0;
  pairs[{1, 3}].rival_votes = GENERATE(1.5, 3.0);
  const bool certain = pairs[{1, 3}].rival_votes < 2.0;
  pairs[{1, 2}].votes = pairs[{2, 3}].votes = 3.0;
  const std::map<RobotId, SE3> moves = common_placement(pairs);
  CHECK(moves.at(3).isApprox(certain ? shifted(20.0) : still));
}

TEST_CASE("the motion of a pair is the same with exchanged ids") {
  std::mt19937 rng(5);
  const SE3 T = random_pose(rng, 30.0);
  const std::array<KeyframeIndex, 2> first{100, 0};
  std::map<KeyframeId, SE3> poses, renamed;
  std::vector<PoseEdge> closures, others;
  for (KeyframeIndex k = 0; k < 300; ++k) {
    const SE3 a = random_pose(rng), b = random_pose(rng);
    const SE3 T_a_b = a.inverse() * (k % 3 == 0 ? random_pose(rng, 30.0) : T) * b;
    poses[{2, first[0] + k}] = renamed[{5, first[0] + k}] = a;
    poses[{5, first[1] + 2 * k}] = renamed[{2, first[1] + 2 * k}] = b;
    closures.push_back({{2, first[0] + k}, {5, first[1] + 2 * k}, T_a_b, {2.0, 3.0}});
    others.push_back({{5, first[0] + k}, {2, first[1] + 2 * k}, T_a_b, {2.0, 3.0}});
  }
  std::ranges::reverse(others);
  const auto one = motion_of_pair(closures, 2, [&](const KeyframeId& id) { return poses.at(id); });
  const auto other =
      motion_of_pair(others, 2, [&](const KeyframeId& id) { return renamed.at(id); });
  REQUIRE((one && other));
  CHECK(one->T.pose().isApprox(other->T.pose().inverse(), kTolerance));
  CHECK(one->centre.isApprox(one->T.pose() * other->centre, kTolerance));
  CHECK(one->radius_m == Approx(other->radius_m));
  CHECK(one->spread_m == Approx(other->spread_m));
  CHECK(one->votes == Approx(other->votes));
  CHECK(one->rival.pose().isApprox(other->rival.pose().inverse(), kTolerance));
  CHECK(one->rival_centre.isApprox(one->rival.pose() * other->rival_centre, kTolerance));
}

TEST_CASE("three rows that agree give a pair a vote among many closures that do not") {
  std::mt19937 rng(4);
  const SE3 T = random_pose(rng, 30.0);
  std::map<KeyframeId, SE3> poses;
  std::vector<PoseEdge> closures;
  const auto add = [&](KeyframeIndex k, const SE3& motion) {
    const SE3 a = poses[{2, k}] = random_pose(rng);
    const SE3 b = poses[{5, k}] = random_pose(rng);
    closures.push_back({{2, k}, {5, k}, a.inverse() * motion * b, {2.0, 3.0}});
  };
  for (KeyframeIndex place = 0; place < 3; ++place)
    for (KeyframeIndex k = 0; k < 4; ++k) add(100 * place + k, T);
  for (KeyframeIndex k = 0; k < 40; ++k) add(1000 + 50 * k, random_pose(rng, 50.0));
  const auto motion =
      motion_of_pair(closures, 2, [&](const KeyframeId& id) { return poses.at(id); });
  REQUIRE(motion);
  CHECK(motion->T.pose().isApprox(T, kTolerance));
  CHECK(motion->spread_m < 1e-9);
}

}  // namespace km
