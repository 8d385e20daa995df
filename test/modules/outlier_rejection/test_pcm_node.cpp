#include "modules/outlier_rejection/node/outlier_rejection_codec.hpp"
#include "modules/outlier_rejection/node/pcm_node.hpp"
#include "test/modules/outlier_rejection/chain.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/corrupted_message.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

struct Team {
  std::mt19937 rng{1};
  Topic<Closure> closures;
  Topic<KeyframeOdometry> keyframes;
  Topic<PeerEvent> restarts;
  Topic<InlierSet> restored, inlier_sets;
  std::vector<InlierSet> sets;
  PcmNode node;

  explicit Team(RobotId self, const PcmConfig& config = {}, std::uint32_t first_version = 0)
      : node(config, self,
             {.closures = closures,
              .keyframes = keyframes,
              .restarts = restarts,
              .restored = restored,
              .inlier_sets = inlier_sets},
             first_version) {
    inlier_sets.subscribe([this](const auto& set) { sets.push_back(*set); });
  }

  void give(const std::vector<Closure>& some) {
    for (const Closure& closure : some) node.step(closure);
  }
  void keyframe_at(double at_s) {
    KeyframeOdometry keyframe{.id = {}, .stamp = nanoseconds(at_s)};
    node.step(keyframe);
  }
  void restart(RobotId robot) {
    RobotIdentity identity{.robot = robot, .name = {}};
    node.step(PeerEvent{PeerEventKind::kRestarted, identity, {}});
  }
  // Sizes of the sets that are now published.
  std::vector<std::size_t> publish() {
    const std::size_t before = sets.size();
    node.publish_changes();
    std::vector<std::size_t> sizes;
    for (std::size_t i = before; i < sets.size(); ++i) sizes.push_back(sets[i].closures.size());
    return sizes;
  }

  // Exact to a millimetre, weighed as such: all agree.
  std::vector<Closure> agreeing(RobotId a, RobotId b, std::size_t count) {
    const TwoRobots robots(a, b, count, 1e-3, rng);
    std::vector<Closure> result;
    for (std::size_t i = 0; i < count; ++i)
      result.push_back(robots.measure(i, count - 1 - i, 1e-3, rng));
    return result;
  }

  std::vector<Closure> agreeing_inside(RobotId robot, std::size_t count) {
    const TwoRobots twice(robot, robot, count + 1, 1e-3, rng);
    std::vector<Closure> result;
    for (std::size_t i = 0; i < count; ++i) {
      const SE3 T_last_i = twice.T_world_a[count].inverse() * twice.T_world_a[i];
      result.push_back(closure(twice.a.at(count), twice.a.at(i), T_last_i, 1e-6));
    }
    return result;
  }
};

using Sizes = std::vector<std::size_t>;

PcmConfig tolerant() {
  PcmConfig config{.selection = ClosureSelection::kPcm, .confidence = 0.9999999, .min_inliers = 3};
  return config;
}

TEST_CASE("The PCM node publishes sets that grew, with versions above those of a former process") {
  constexpr std::uint32_t kFirst = 3U << 16U;
  Team team(2, tolerant(), kFirst);
  const auto closures = team.agreeing(2, 5, 5);
  team.give({closures[0], closures[1]});
  CHECK(team.publish().empty());  // below min_inliers
  team.give({closures[2]});
  CHECK(team.publish() == Sizes{3});
  CHECK(team.publish().empty());
  team.give({closures[2]});
  CHECK(team.publish().empty());  // repeated
  team.give({closures[3], closures[4]});
  CHECK(team.publish() == Sizes{5});
  CHECK(team.sets[0].version == kFirst + 1);
  CHECK(team.sets[0].version < team.sets[1].version);
  CHECK(std::ranges::is_sorted(team.sets[1].closures));
  for (const InlierSet& set : team.sets) CHECK((set.a == 2 && set.b == 5));
}

TEST_CASE("The PCM node decides for the pairs in which it is the lower, and for itself") {
  Team team(4, tolerant());
  team.give(team.agreeing_inside(4, 4));
  for (const auto& [a, b] : {std::pair<RobotId, RobotId>{9, 4}, {3, 4}, {5, 6}})
    team.give(team.agreeing(a, b, 4));
  REQUIRE(team.publish().size() == 2);
  CHECK((team.sets[0].a == 4 && team.sets[0].b == 4));
  CHECK((team.sets[1].a == 4 && team.sets[1].b == 9));
}

TEST_CASE("All closures of two robots are published once independent ones agree") {
  Team team(2);
  auto closures = team.agreeing(2, 5, 20);
  closures[1].T_from_to = random_pose(team.rng);  // false, and a neighbour of the first
  team.give({closures[0], closures[1], reversed(closures[0])});
  CHECK(team.publish().empty());
  team.give({closures[9]});
  CHECK(team.publish() == Sizes{3});
  CHECK(team.publish().empty());
  team.give({closures[10]});
  CHECK(team.publish() == Sizes{4});
  CHECK(std::ranges::is_sorted(team.sets[1].closures));
  CHECK(team.sets[0].version < team.sets[1].version);
}

TEST_CASE("Robots joined by one place wait for a second one, and it is said") {
  PcmConfig config{.witness_wait_s = 30.0};
  Team team(2, config);
  const CapturedLog log;
  const auto closures = team.agreeing(2, 5, 3);  // all neighbours
  team.give({closures[0]});
  CHECK(team.publish().empty());  // without a keyframe there is no time
  team.keyframe_at(1000.0);
  CHECK(team.publish().empty());
  team.give({closures[1]});
  team.keyframe_at(1029.9);
  CHECK(team.publish().empty());
  CHECK(log.text().empty());
  team.keyframe_at(1030.0);
  CHECK(team.publish() == Sizes{2});
  CHECK_THAT(log.text(), Contains("robots 2 5: joined by one place only"));
  team.give({closures[2]});
  CHECK(team.publish() == Sizes{3});  // the wait is over permanently
}

TEST_CASE("Weak closures at one place join two robots only if one at another place agrees") {
  const bool is_strong = GENERATE(false, true);
  const RobotId other = is_strong ? 21 : 22;  // a warning for each pair
  Team team(2);
  const CapturedLog log;
  auto closures = team.agreeing(2, other, 20);
  for (Closure& closure : closures) closure.inliers = 70;
  team.give({closures[0], closures[1]});  // neighbours
  team.node.expect_no_more();
  CHECK(team.publish().empty());
  CHECK(team.publish().empty());
  CHECK_THAT(log.text(), Contains("not joined: at their best place closures have 140 inliers "
                                  "of pcm.min_lone_support 150"));
  if (is_strong) closures[2].inliers = 10;  // a neighbour, too
  team.give({closures[is_strong ? 2 : 9]});
  CHECK(team.publish() == Sizes{3});
  CHECK((log.text().find("the join is tentative") != std::string::npos) == is_strong);
}

TEST_CASE("Robots that a former process joined by one place remain joined") {
  Team team(2);
  const auto closures = team.agreeing(2, 5, 2);
  team.give({closures[0]});
  CHECK(team.publish().empty());
  team.node.step(InlierSet{1, 2, 0, {}});  // decided by another robot
  team.node.step(InlierSet{2, 5, 0, {closures[0].id()}});
  CHECK(team.publish() == Sizes{1});
  CHECK(team.sets[0].closures[0] == closures[0].id());
}

TEST_CASE("At the end of all runs no pair waits for a witness") {
  Team team(2);
  const CapturedLog log;
  team.keyframe_at(10.0);
  team.give(team.agreeing(2, 5, 1));
  CHECK(team.publish().empty());
  team.keyframe_at(12.0);
  CHECK(team.publish().empty());
  team.node.expect_no_more();
  CHECK(team.publish() == Sizes{1});
  CHECK_THAT(log.text(), Contains("no other place has agreed within 2 s"));
}

TEST_CASE("Closures inside the robot need no witness") {
  Team team(4);
  team.give({team.agreeing_inside(4, 4)[0]});
  CHECK(team.publish() == Sizes{1});
}

TEST_CASE("The closures of a restarted peer are removed, and its pair waits again") {
  Team team(2);
  const auto before = team.agreeing(2, 5, 20), after = team.agreeing(2, 5, 20);
  team.give(before);
  CHECK(team.publish() == Sizes{20});
  team.node.expect_no_more();
  team.restart(5);
  team.give({after[3]});
  CHECK(team.publish().empty());
  team.give({after[17]});
  CHECK(team.publish() == Sizes{2});
  CHECK(team.sets[0].version < team.sets[1].version);
}

const InlierSet kSet{.a = 3,
                     .b = 700,
                     .version = 12,
                     .closures = {{{3, 0}, {700, 9}}, {{3, 5}, {700, 1}}, {{3, 5}, {700, 4}}}};

TEST_CASE("An inlier set survives the wire") {
  const auto encoded = encoded_by(kSet.a, kSet);
  const Decoded<InlierSet> result = decoded(encoded);
  REQUIRE(result.value);
  CHECK(result.value->a == kSet.a);
  CHECK(result.value->b == kSet.b);
  CHECK(result.value->version == kSet.version);
  CHECK(result.value->closures == kSet.closures);
  const InlierSet empty{.a = 5, .b = 5, .version = 1, .closures = {}};
  CHECK(decoded(encoded_by(5, empty)).value);
}

TEST_CASE("An inlier set that cannot be is refused") {
  check_refusals<InlierSet>(
      [] { return encoded_by(kSet.a, kSet); },
      {{"descending pair", "the pair is not in ascending order",
        [](auto& m) { std::swap(m.wire.a, m.wire.b); }},
       {"written by the higher robot", "decided by another robot than the lower",
        [](auto& m) { m.writer.robot = 700; }},
       {"of a third robot", "a closure of another pair",
        [](auto& m) { m.closures[1].to.robot = 4; }},
       {"inside one of two robots", "a closure of another pair",
        [](auto& m) { m.closures[0].to.robot = 3; }},
       {"repeated", "closures are not ascending", [](auto& m) { m.closures[1] = m.closures[0]; }},
       {"descending closures", "closures are not ascending",
        [](auto& m) { std::swap(m.closures[0], m.closures[2]); }},
       {"a second name of a closure", "a closure is named by its higher end first",
        [](auto& m) { std::swap(m.closures[1].from, m.closures[1].to); }},
       {"claimed without being there", "closures are missing or too many",
        [](auto& m) { m.wire.closures._buffer = nullptr; }},
       {"a length without end", "closures are missing or too many",
        [](auto& m) { m.wire.closures._length = 0xffffffffU; }}});
  const InlierSet inside{.a = 5, .b = 5, .version = 1, .closures = {{{5, 2}, {5, 9}}}};
  check_refusals<InlierSet>([&] { return encoded_by(5, inside); },
                            {{"a keyframe with itself", "a closure from a keyframe to itself",
                              [](auto& m) { m.closures[0].from.index = 9; }}});
}

}  // namespace
}  // namespace km
