#include <catch2/catch.hpp>

#include <algorithm>
#include <deque>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <utility>

#include "modules/place_recognition/place_recognition_node.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"

namespace km {
namespace {

constexpr RobotId kSelf = 3;
constexpr RobotId kPeer = 40000;

// Keeps what a topic publishes; read it after the node has stopped, or in a test that steps.
template <typename T>
struct Recorder {
  Topic<T> topic;
  std::vector<T> received;
  Recorder() {
    topic.subscribe([this](const auto& message) { received.push_back(*message); });
  }
};

struct Robot {
  Topic<Keyframe> keyframes;
  Topic<KeyframeBow> peer_bows;
  Recorder<KeyframeBow> own_bows;
  Recorder<LoopCandidate> candidates;
  Recorder<PlaceQuery> queries;
  PlaceRecognitionNode node;

  explicit Robot(RobotId self, const PlaceRecognitionConfig& config = {},
                 const Vocabulary& vocabulary = toy_vocabulary(100))
      : node(config, self, std::make_shared<const Vocabulary>(vocabulary),
             {.keyframes = keyframes,
              .peer_bows = peer_bows,
              .own_bows = own_bows.topic,
              .candidates = candidates.topic,
              .queries = queries.topic}) {}
};

Keyframe keyframe(KeyframeId id, std::initializer_list<std::uint32_t> words) {
  Keyframe result;
  result.odometry.id = id;
  result.stamp = nanoseconds(0.5 * id.index);
  for (const std::uint32_t word : words)
    result.features.descriptors.push_back(toy_descriptor(word));
  return result;
}

KeyframeBow bow(KeyframeId id, std::initializer_list<std::uint32_t> words) {
  KeyframeBow message{.id = id, .stamp = 0, .vocabulary = toy_vocabulary(100).id(), .words = {}};
  for (const std::uint32_t word : words) message.words.push_back({word, 1});
  return message;
}

TEST_CASE("Every own keyframe is published as its words", "[place_recognition][node]") {
  Robot robot(kSelf);
  robot.node.step(keyframe({kSelf, 0}, {5, 2, 5}));
  REQUIRE(robot.own_bows.received.size() == 1);
  const KeyframeBow& sent = robot.own_bows.received[0];
  CHECK(sent.id == KeyframeId{kSelf, 0});
  CHECK(sent.vocabulary == toy_vocabulary(100).id());
  CHECK(sent.words == BagOfWords{{2, 1}, {5, 2}});
}

TEST_CASE("A peer's view of a known place is a candidate, through the thread",
          "[place_recognition][node]") {
  Robot robot(kSelf);
  robot.node.start();
  robot.keyframes.publish(keyframe({kSelf, 0}, {1, 2, 3, 4}));
  robot.keyframes.publish(keyframe({kSelf, 1}, {11, 12, 13, 14}));
  robot.peer_bows.publish(bow({kPeer, 0}, {1, 2, 3, 4}));
  robot.peer_bows.publish(bow({kPeer, 1}, {1, 2, 3, 5}));
  robot.node.stop();
  CHECK(robot.node.error() == nullptr);
  REQUIRE(robot.candidates.received.size() == 1);  // keyframe 0 of the peer has no normaliser
  CHECK(robot.candidates.received[0].query == KeyframeId{kPeer, 1});
  CHECK(robot.candidates.received[0].match == KeyframeId{kSelf, 0});
  CHECK(robot.candidates.received[0].similarity == Approx(1.0));
  CHECK(robot.queries.received.size() == 4);
}

TEST_CASE("A return to a place after the gap is a candidate inside one robot",
          "[place_recognition][node]") {
  Robot robot(kSelf, {.min_gap_s = 10.0});  // 20 keyframes of toy time
  robot.node.step(keyframe({kSelf, 0}, {1, 2, 3, 4}));
  for (std::uint32_t i = 1; i < 20; ++i) robot.node.step(keyframe({kSelf, i}, {50, 51, 4, 5}));
  CHECK(robot.candidates.received.empty());
  robot.node.step(keyframe({kSelf, 20}, {1, 2, 3, 4}));
  REQUIRE(robot.candidates.received.size() == 1);
  CHECK(robot.candidates.received[0].query == KeyframeId{kSelf, 20});
  CHECK(robot.candidates.received[0].match == KeyframeId{kSelf, 0});
}

TEST_CASE("A history that arrives backwards gives the candidates of one in order",
          "[place_recognition][node]") {
  const auto candidates_of = [](bool backwards) {
    Robot robot(kSelf, {.similarity_threshold = 0.2, .max_waiting_keyframes = 100});
    for (std::uint32_t i = 0; i < 20; ++i)
      robot.node.step(keyframe({kSelf, i}, {i, i + 1, i + 2, i + 3}));
    for (std::uint32_t k = 0; k < 30; ++k) {
      const std::uint32_t i = backwards ? 29 - k : k;
      robot.node.step(bow({kPeer, i}, {i, i + 1, i + 2, i + 3}));
    }
    std::map<std::pair<KeyframeId, KeyframeId>, double> found;
    for (const LoopCandidate& c : robot.candidates.received)
      found[{c.query, c.match}] = c.similarity;
    CHECK(found.size() == robot.candidates.received.size());
    return found;
  };
  const auto in_order = candidates_of(false);
  CHECK(in_order.size() > 20);
  CHECK(candidates_of(true) == in_order);
}

TEST_CASE("What cannot be compared is reported and harms nothing", "[place_recognition][node]") {
  Robot robot(kSelf);
  robot.node.step(keyframe({kSelf, 0}, {1, 2, 3, 4}));
  robot.queries.received.clear();
  const auto status_after = [&](const KeyframeBow& message) {
    robot.node.step(message);
    REQUIRE(robot.queries.received.size() == 1);
    const PlaceQuery query = robot.queries.received[0];
    robot.queries.received.clear();
    CHECK(query.query == message.id);
    return query.status;
  };
  KeyframeBow other = bow({kPeer, 0}, {1, 2, 3, 4});
  other.vocabulary = toy_vocabulary(100, 2.0F).id();
  CHECK(status_after(other) == PlaceQueryStatus::kOtherVocabulary);
  CHECK(status_after(bow({kPeer, 0}, {1, 100})) == PlaceQueryStatus::kUnknownWords);
  CHECK(status_after(bow({kPeer, 0}, {1, 2, 3, 4})) == PlaceQueryStatus::kSearched);
  CHECK(status_after(bow({kPeer, 0}, {1, 2, 3, 4})) == PlaceQueryStatus::kRepeated);
  CHECK(status_after(bow({kPeer, 1}, {})) == PlaceQueryStatus::kSearched);
  CHECK(robot.candidates.received.empty());
  robot.node.step(bow({kSelf, 0}, {1, 2, 3, 4}));  // its own, come back
  CHECK(robot.queries.received.empty());
}

// What the class comment claims: the pair is found, whichever message is first.
TEST_CASE("No pair of keyframes of two robots is missed in any order of delivery",
          "[place_recognition][node]") {
  const auto seed = GENERATE(range(0U, 25U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  constexpr std::uint32_t kKeyframes = 12;
  const PlaceRecognitionConfig config{.max_candidates = 1000, .max_waiting_keyframes = 100};
  Robot a(1, config);
  Robot b(2, config);
  // Each action: a new keyframe of one robot, or one delivery, links being ordered.
  std::size_t sent_to_a = 0;
  std::size_t sent_to_b = 0;
  std::uint32_t made_a = 0;
  std::uint32_t made_b = 0;
  const auto deliver = [](Robot& from, Robot& to, std::size_t& sent) {
    if (sent < from.own_bows.received.size()) to.node.step(from.own_bows.received[sent++]);
  };
  while (sent_to_a + sent_to_b < 2 * kKeyframes) {
    switch (rng() % 4U) {
      case 0:
        if (made_a < kKeyframes) a.node.step(keyframe({1, made_a++}, {1, 2, 3}));
        break;
      case 1:
        if (made_b < kKeyframes) b.node.step(keyframe({2, made_b++}, {1, 2, 3}));
        break;
      case 2:
        deliver(a, b, sent_to_b);
        break;
      default:
        deliver(b, a, sent_to_a);
    }
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;  // index in a, index in b
  for (const LoopCandidate& c : a.candidates.received)
    if (c.query.robot == 2) pairs.insert({c.match.index, c.query.index});
  for (const LoopCandidate& c : b.candidates.received)
    if (c.query.robot == 1) pairs.insert({c.query.index, c.match.index});
  // Keyframe 0 has no predecessor, hence no normaliser as a query: its pairs are found only when
  // it is the one that is known already.
  for (std::uint32_t i = 1; i < kKeyframes; ++i)
    for (std::uint32_t j = 1; j < kKeyframes; ++j) CHECK(pairs.contains({i, j}));
}

TEST_CASE("A keyframe of the past ends the node with an exception", "[place_recognition][node]") {
  Robot robot(kSelf);
  robot.node.start();
  robot.keyframes.publish(keyframe({kSelf, 5}, {1}));
  robot.keyframes.publish(keyframe({kSelf, 4}, {1}));
  robot.node.stop();
  CHECK(robot.node.error() != nullptr);
}

}  // namespace
}  // namespace km
