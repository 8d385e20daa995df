#include "modules/loop_closure/matching.hpp"
#include "test/modules/loop_closure/loop_closure_robots.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Which parts of a keyframe a robot requests, and what its owner sends.

TEST_CASE(
    "words that arrive near a closure that was verified meanwhile lead to no further request") {
  Meeting meeting(scene_with_words(31));
  tell_words(meeting);
  auto& [scene, robot, peer] = meeting;
  Keyframe next = scene.peer;
  next.odometry.id.index = 6;
  peer.give(next);
  robot.give(scene.candidate());
  robot.give(LoopCandidate{next.odometry.id, scene.own.odometry.id, 1.5});
  REQUIRE(robot.requests.size() == 2);
  peer.node.step(robot.requests[1].message);
  const auto late = std::exchange(peer.words, {})[0].message;
  robot.requests.pop_back();
  deliver(robot, peer);
  REQUIRE(robot.closures.size() == 1);
  robot.node.step(late);
  CHECK(robot.requests.empty());
  CHECK(robot.reports.back().stage == kRequested);
  CHECK(robot.reports.back().reason == "not requested: near a verified closure");
}

TEST_CASE("a reply contains the points whose words the requester's own keyframe has") {
  const bool has_bow = GENERATE(true, false);
  CAPTURE(has_bow);
  const Scene scene(13);
  constexpr std::uint32_t kSent = 50;
  Robot robot(kSelf, {.min_word_points = 0}), peer(kPeer, {.reply_keypoints = kSent});
  Keyframe full = scene.peer;
  const auto words = static_cast<std::uint32_t>(full.features.descriptors.size());
  for (std::uint32_t i = 0; i < words; ++i) full.features.descriptors[i] = toy_descriptor(i);
  full.features.keypoints[100].inverse_depth = 0.0F;
  peer.give(full);
  BagOfWords theirs;  // words of the last points except for the very last
  for (std::uint32_t word = words - kSent; word + 1 < words; ++word) theirs.push_back({word, 1});
  const Vocabulary vocabulary = toy_vocabulary(200);
  if (has_bow)
    peer.give(KeyframeBow{.id = {kSelf, 0}, .vocabulary = vocabulary.id(), .words = theirs});
  peer.give(KeyframeBow{.id = {kSelf, 1}, .vocabulary = vocabulary.id(), .words = {{3, 1}}});
  peer.give(KeyframeBow{.id = {kSelf, 0}, .vocabulary = 1, .words = {{4, 1}}});
  robot.give(scene.own);
  robot.give(scene.candidate());
  REQUIRE(robot.requests.size() == 1);
  CHECK(robot.requests[0].message->own == 0);
  peer.node.step(robot.requests[0].message);
  REQUIRE(peer.replies.size() == 1);
  // Those of the words, then the strongest others, none of them without depth.
  std::vector<BinaryDescriptor> expected;
  for (std::uint32_t word = words - kSent; has_bow && word + 1 < words; ++word)
    if (word != 100) expected.push_back(toy_descriptor(word));
  for (std::uint32_t word = 0; expected.size() < kSent; ++word)
    expected.push_back(toy_descriptor(word));
  const KeyframeFeatures& sent = peer.replies[0].message->keyframe.features;
  CHECK(sent.matched == orb_bits(expected));
  CHECK(sent.keypoints.size() == expected.size());
}

TEST_CASE("the features of a keyframe are requested once its words agree with an own keyframe") {
  Meeting meeting(scene_with_words(21));
  tell_words(meeting);
  auto& [scene, robot, peer] = meeting;
  robot.give(scene.candidate());
  REQUIRE(robot.requests.size() == 1);
  CHECK(robot.requests[0].message->part == KeyframePart::kWordPoints);
  peer.node.step(std::exchange(robot.requests, {})[0].message);
  REQUIRE(peer.words.size() == 1);
  CHECK(peer.words[0].to == kSelf);
  CHECK(peer.words[0].message->words.points.size() == 100);  // half of 200
  CHECK(peer.replies.empty());
  const auto words = std::exchange(peer.words, {})[0].message;
  robot.node.step(words);
  robot.node.step(words);  // a late reply to a repeated request
  REQUIRE(robot.requests.size() == 1);
  CHECK(robot.requests[0].message->part == KeyframePart::kDescriptors);
  CHECK(robot.closures.empty());
  peer.node.step(std::exchange(robot.requests, {})[0].message);
  REQUIRE(peer.replies.size() == 1);
  const std::span all(scene.peer.features.descriptors);
  REQUIRE(all.size() == 150);
  CHECK(peer.replies[0].message->descriptors == orb_bits(all.first(100)));
  CHECK(peer.replies[0].message->keyframe.features.matched == orb_bits(all.subspan(100)));
  deliver(robot, peer);
  REQUIRE(robot.closures.size() == 1);
  CHECK(robot.closures[0].inliers > 100);
  CHECK(stages_of(robot.reports) == Stages{kCandidate, kRequested, kVerified});
}

TEST_CASE(
    "descriptors of other points than those of the words are replaced by the whole keyframe") {
  Meeting meeting(scene_with_words(25));
  tell_words(meeting);
  auto& [scene, robot, peer] = meeting;
  robot.give(scene.candidate());
  peer.node.step(std::exchange(robot.requests, {})[0].message);
  SECTION("the owner has a keypoint less") {
    robot.node.step(std::exchange(peer.words, {})[0].message);
    Keyframe less = scene.peer;
    less.features.keypoints.pop_back();
    less.features.descriptors.pop_back();
    peer.give(less);
  }
  SECTION("a peer sends descriptors before its points") {
    robot.give(KeyframeReply{.number = 0,
                             .found = true,
                             .keyframe = scene.peer,
                             .descriptors = orb_bits(scene.peer.features.descriptors)});
    REQUIRE(robot.requests.size() == 1);
    CHECK(robot.requests[0].message->part == KeyframePart::kFeatures);
  }
  deliver(robot, peer);
  REQUIRE(robot.closures.size() == 1);
  CHECK(robot.closures[0].inliers > 100);
}

TEST_CASE("no features are requested of a keyframe whose words are elsewhere") {
  Meeting meeting(scene_with_words(22));
  tell_words(meeting);
  auto& [scene, robot, peer] = meeting;
  std::mt19937 rng(23);
  const KeyframePair other = make_keyframe_pair(rng, 150, {0.7, 0.3}, 1.0);
  scene.peer.features.keypoints = other.to.keypoints;
  peer.give(scene.peer);
  robot.give(scene.candidate());
  deliver(robot, peer);
  CHECK(robot.requests.empty());
  CHECK(robot.closures.empty());
  REQUIRE(stages_of(robot.reports) == Stages{kCandidate, kRequested, kReceived});
  CHECK(robot.reports.back().reason == "common words do not agree on a pose");
  // Another candidate of the keyframe is compared again.
  robot.give(LoopCandidate{scene.peer.odometry.id, {kSelf, 900}, 1.5});
  Keyframe again = scene.own;
  again.odometry.id.index = 900;
  robot.give(again);
  robot.tick(1.0);
  REQUIRE(robot.requests.size() == 1);
  CHECK(robot.requests[0].message->part == KeyframePart::kWordPoints);
  CHECK(robot.requests[0].message->own == 900);
}

TEST_CASE("keyframes are matched by the network that both robots have, and otherwise by ORB") {
  const auto [own, theirs] =
      GENERATE(std::pair(7, 7), std::pair(7, 8), std::pair(7, 0), std::pair(0, 7));
  const bool by_network = own == theirs;
  Scene views(42);
  describe(views, static_cast<std::uint16_t>(own), static_cast<std::uint16_t>(theirs));
  for (Keyframe* keyframe : {&views.own, &views.peer})
    if (keyframe->features.network == 0) keyframe->features.matched.clear();
  if (by_network)
    for (BinaryDescriptor& descriptor : views.peer.features.descriptors) descriptor = {};
  Meeting meeting(views);
  auto& [scene, robot, peer] = meeting;
  robot.give(scene.candidate());
  peer.node.step(std::exchange(robot.requests, {})[0].message);
  REQUIRE(peer.replies.size() == 1);
  const KeyframeFeatures& sent = peer.replies[0].message->keyframe.features;
  CHECK(sent.network == (by_network ? 7 : 0));
  CHECK(sent.matched ==
        (by_network ? scene.peer.features.matched : orb_bits(scene.peer.features.descriptors)));
  CHECK(sent.descriptors.empty());
  deliver(robot, peer);
  REQUIRE(robot.closures.size() == 1);
  CHECK(robot.closures[0].inliers > 100);
}

}  // namespace
}  // namespace km
