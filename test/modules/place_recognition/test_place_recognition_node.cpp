#include "modules/place_recognition/node/place_recognition_codec.hpp"
#include "modules/place_recognition/node/place_recognition_node.hpp"
#include "modules/place_recognition/packed_bits.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"
#include "test/support/corrupted_message.hpp"
#include "test/support/test.hpp"

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
  Topic<Closure> closures;
  Topic<PeerEvent> peer_events;
  Recorder<KeyframeBow> own_bows;
  Recorder<LoopCandidate> candidates;
  Recorder<PeerEvent> restarts;
  Recorder<PlaceQuery> queries;
  PlaceRecognitionNode node;

  explicit Robot(RobotId self, const PlaceRecognitionConfig& config = {},
                 const Vocabulary& vocabulary = toy_vocabulary(100))
      : node(config, self, std::make_shared<const Vocabulary>(vocabulary),
             {.keyframes = keyframes,
              .peer_bows = peer_bows,
              .closures = closures,
              .peer_events = peer_events,
              .own_bows = own_bows.topic,
              .candidates = candidates.topic,
              .restarts = restarts.topic,
              .queries = queries.topic}) {}
};

// `spacing_s`: time between successive keyframes; with 10 s or more all earlier ones are searched.
Keyframe keyframe(KeyframeId id, const std::vector<std::uint32_t>& words, double spacing_s = 0.5) {
  Keyframe result;
  result.odometry.id = id;
  result.stamp = nanoseconds(spacing_s * id.index);
  for (const std::uint32_t word : words)
    result.features.descriptors.push_back(toy_descriptor(word));
  return result;
}

// `normalizer`: score with the keyframe before it.
KeyframeBow bow(KeyframeId id, std::initializer_list<std::uint32_t> words,
                double normalizer = 1.0) {
  KeyframeBow message{.id = id,
                      .stamp = 0,
                      .vocabulary = toy_vocabulary(100).id(),
                      .words = {},
                      .normalizer = normalizer};
  for (const std::uint32_t word : words) message.words.push_back({word, 1});
  return message;
}

TEST_CASE("Keyframes that differ from the one sent before are sent with words and a normaliser") {
  Robot robot(kSelf, {.new_view_score = 0.6});
  robot.node.step(keyframe({kSelf, 0}, {1, 2, 3, 4}, 10.0));
  robot.node.step(keyframe({kSelf, 1}, {1, 2, 3, 5}, 10.0));  // score 0.75 with the one before
  robot.node.step(keyframe({kSelf, 2}, {1, 2, 5, 6}, 10.0));  // 0.5 with the last view
  REQUIRE(robot.own_bows.received.size() == 3);
  CHECK(robot.own_bows.received[1].words.empty());
  CHECK(robot.own_bows.received[1].normalizer == 0.0);
  CHECK(robot.own_bows.received[2].words.size() == 4);
  CHECK(robot.own_bows.received[2].normalizer == Approx(0.75));
  // A peer finds the views, and the robot itself compares each keyframe with its views.
  robot.node.step(bow({kPeer, 7}, {1, 2, 5, 6}));
  std::vector<std::pair<KeyframeId, KeyframeIndex>> pairs;
  for (const LoopCandidate& found : robot.candidates.received)
    pairs.emplace_back(found.query, found.match.index);
  CHECK(pairs == std::vector<std::pair<KeyframeId, KeyframeIndex>>{
                     {{kSelf, 1}, 0}, {{kSelf, 2}, 0}, {{kPeer, 7}, 2}, {{kPeer, 7}, 0}});
}

TEST_CASE("The words of the strongest keypoints are published and compared") {
  Robot robot(kSelf, {.word_keypoints = 50});
  std::vector<std::uint32_t> words(50, 5);  // that of the strongest keypoint first
  words[10] = 7;
  words.insert(words.end(), {2, 3});
  robot.node.step(keyframe({kSelf, 0}, words));
  const KeyframeBow& sent = robot.own_bows.received.at(0);
  CHECK(sent.id == KeyframeId{kSelf, 0});
  CHECK(sent.vocabulary == toy_vocabulary(100).id());
  CHECK(sent.words == BagOfWords{{5, 49}, {7, 1}});
  CHECK(sent.normalizer == 0.0);
  robot.node.step(bow({kPeer, 1}, {5, 7}));
  REQUIRE(robot.candidates.received.size() == 1);
  robot.node.step(bow({kPeer, 2}, {2, 3}));
  CHECK(robot.candidates.received.size() == 1);
}

TEST_CASE("A peer's view of a known place is a candidate, through the thread") {
  Robot robot(kSelf);
  robot.node.start();
  robot.keyframes.publish(keyframe({kSelf, 0}, {1, 2, 3, 4}));
  robot.keyframes.publish(keyframe({kSelf, 1}, {11, 12, 13, 14}));
  robot.peer_bows.publish(bow({kPeer, 0}, {1, 2, 3, 4}, 0.0));
  robot.peer_bows.publish(bow({kPeer, 1}, {1, 2, 3, 5}, 0.75));
  robot.node.stop();
  CHECK(robot.node.error() == nullptr);
  REQUIRE(robot.candidates.received.size() == 1);  // keyframe 0 of the peer has no normaliser
  CHECK(robot.candidates.received[0].query == KeyframeId{kPeer, 1});
  CHECK(robot.candidates.received[0].match == KeyframeId{kSelf, 0});
  CHECK(robot.candidates.received[0].similarity == Approx(1.0));
  CHECK(robot.queries.received.size() == 4);
}

TEST_CASE(
    "The keyframes of a restarted peer are searched again and those of a resumed one are not") {
  const auto kind = GENERATE(PeerEventKind::kRestarted, PeerEventKind::kResumed);
  Robot robot(kSelf);
  robot.node.step(keyframe({kSelf, 0}, {1, 2, 3, 4}));
  robot.node.step(keyframe({kSelf, 1}, {11, 12, 13, 14}));
  robot.node.step(bow({kPeer, 0}, {1, 2, 3, 4}, 0.0));
  robot.node.step(bow({kPeer, 1}, {1, 2, 3, 5}, 0.75));
  REQUIRE(robot.candidates.received.size() == 1);
  PeerEvent event{kind, {}, {}};
  event.identity.robot = kPeer;
  robot.node.step(std::make_shared<const PeerEvent>(event));
  const bool restarted = kind == PeerEventKind::kRestarted;
  CHECK(robot.restarts.received.size() == (restarted ? 1 : 0));  // before the outputs below
  robot.node.step(bow({kPeer, 0}, {11, 12, 13, 14}, 0.0));
  robot.node.step(bow({kPeer, 1}, {11, 12, 13, 15}, 0.75));
  REQUIRE(robot.candidates.received.size() == (restarted ? 2 : 1));
  if (restarted) CHECK(robot.candidates.received[1].match == KeyframeId{kSelf, 1});
}

// A keyframe of one place, whose depth is known.
Keyframe view(KeyframeIndex index) {
  Keyframe result = keyframe({kSelf, index}, {1, 2, 3, 4}, 10.0);
  result.features.keypoints.assign(4, {.inverse_depth = 0.25F});
  return result;
}

TEST_CASE("A keyframe at a known place has no words for the peers and is no match") {
  Robot robot(kSelf, {.new_view_score = 2.0});
  robot.node.step(view(0));
  robot.node.step(view(1));
  REQUIRE(robot.candidates.received.size() == 1);
  const Closure verified{
      .from = view(0).odometry, .to = view(1).odometry, .covariance = Matrix6::Zero()};
  Closure foreign = verified;
  foreign.from.id.robot = kPeer;
  robot.node.step(foreign);
  robot.node.step(view(2));
  REQUIRE(robot.candidates.received.size() == 3);
  robot.node.step(verified);
  robot.node.step(view(3));
  CHECK(robot.candidates.received.size() == 3);
  CHECK(robot.own_bows.received[2].words.size() == 4);
  REQUIRE(robot.own_bows.received.size() == 4);
  CHECK(robot.own_bows.received[3].words.empty());
  robot.candidates.received.clear();
  robot.node.step(bow({kPeer, 1}, {1, 2, 3, 4}));
  CHECK(robot.candidates.received.size() == 3);
}

TEST_CASE(
    "A keyframe at a known place has two candidates if a closure is due, and otherwise none") {
  Robot robot(kSelf, {.new_view_score = 2.0});
  for (std::uint32_t index = 0; index < 5; ++index) robot.node.step(view(index));
  CHECK(robot.candidates.received.back().query.index == 4);
  robot.node.step(
      Closure{.from = view(0).odometry, .to = view(4).odometry, .covariance = Matrix6::Zero()});
  const std::uint32_t last_fresh = 4 + KnownPlaces::kFreshKeyframes;
  for (std::uint32_t index = 5; index < last_fresh + 3; ++index) {
    robot.candidates.received.clear();
    robot.node.step(view(index));
    CHECK(robot.candidates.received.size() == (index <= last_fresh ? 0 : 2));
  }
}

TEST_CASE("Keyframes before a loss of odometry are candidates at once") {
  Robot robot(kSelf, {.new_view_score = 2.0});
  for (std::uint32_t i = 0; i < 3; ++i) robot.node.step(keyframe({kSelf, i}, {1, 2, 3, 4}));
  CHECK(robot.candidates.received.empty());
  Keyframe after = keyframe({kSelf, 3}, {1, 2, 3, 4});
  const double variance = GENERATE(1.0, std::nan(""));
  after.odometry.covariance.diagonal().tail<3>().setConstant(variance);
  robot.node.step(after);
  CHECK(robot.candidates.received.size() == 3);
  if (std::isnan(variance)) return;
  after.odometry.id.index = 4;
  robot.node.step(after);  // the step to this one is known
  for (std::size_t k = 3; k < robot.candidates.received.size(); ++k)
    CHECK(robot.candidates.received[k].match.index < 3);
}

TEST_CASE("Keyframes that cannot be compared are reported and change nothing") {
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
  CHECK(status_after(bow({kPeer, 0}, {1, 2, 3, 4}, 0.0)) == PlaceQueryStatus::kSearched);
  CHECK(status_after(bow({kPeer, 0}, {1, 2, 3, 4})) == PlaceQueryStatus::kRepeated);
  CHECK(status_after(bow({kPeer, 1}, {})) == PlaceQueryStatus::kSearched);
  CHECK(robot.candidates.received.empty());
  robot.node.step(bow({kSelf, 0}, {1, 2, 3, 4}));  // own bag that returns
  CHECK(robot.queries.received.empty());
}

// Tests the claim of the class comment: the pair is found in either order of the messages.
TEST_CASE("No pair of keyframes of two robots is missed in any order of delivery") {
  const auto seed = GENERATE(range(0U, 25U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  constexpr std::uint32_t kKeyframes = 12;
  const PlaceRecognitionConfig config{.max_candidates = 1000, .new_view_score = 2.0};
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

constexpr std::uint32_t kMax = ~0U;

TEST_CASE("Bags survive packing, at about six bits a word") {
  for (const BagOfWords& bag :
       std::vector<BagOfWords>{{}, {{0, 2}, {1, 1}, {2, 3}}, {{0, kMax}, {kMax - 1, 1}, {kMax, 2}}})
    CHECK(unpack(pack(bag)) == bag);
  const auto seed = GENERATE(range(0U, 10U));
  const double mean_gap = GENERATE(0.1, 1.0, 8.0, 1e6);
  CAPTURE(seed, mean_gap);
  std::mt19937 rng(seed);
  std::geometric_distribution<std::uint32_t> gap(1.0 / (1.0 + mean_gap));
  std::geometric_distribution<std::uint32_t> more(0.9);
  BagOfWords bag;
  for (std::uint32_t word = 0; bag.size() < 1000; ++word) {
    word += gap(rng);
    bag.push_back({word, 1 + more(rng)});
  }
  const std::vector<std::uint8_t> bytes = pack(bag);
  CHECK(unpack(bytes) == bag);
  // A gap has at most log2(e (1 + mean)) bits of information. The code may add half a bit, and half
  // a bit is for rounding of the mean. Nine of ten words cost one bit for their count.
  const double bits = std::log2(std::exp(1.0) * (1.0 + mean_gap)) + 1.0 + 1.3;
  CHECK(8.0 * static_cast<double>(bytes.size()) < 1000.0 * bits);
}

TEST_CASE("Bytes that are no bag are refused") {
  using Bytes = std::vector<std::uint8_t>;
  const Bytes good = pack({{3, 1}, {900, 4}, {70000, 1}});
  REQUIRE(unpack(good));
  CHECK_FALSE(unpack(Bytes{}));
  for (std::size_t size = 0; size < good.size(); ++size)
    CHECK_FALSE(unpack(std::span(good).first(size)));
  Bytes longer = good;
  longer.push_back(0x00);
  CHECK_FALSE(unpack(longer));  // data after the last word
  Bytes filled = good;
  filled.back() |= 0x01U;
  CHECK_FALSE(unpack(filled));           // other than zeros after the last word
  CHECK_FALSE(unpack(Bytes(16, 0x00)));  // a number without end
  CHECK_FALSE(unpack(Bytes(16, 0xFF)));  // ends before the first word

  const auto bag_of = [](std::uint64_t size, unsigned parameter, std::uint64_t gap,
                         std::uint64_t count) {
    BitWriter bits;
    bits.gamma(size + 1);
    bits.bits(parameter, 5);
    for (std::uint64_t k = 0; k < size; ++k) {
      bits.rice(gap, parameter);
      bits.gamma(count);
    }
    return bits.take();
  };
  CHECK(unpack(bag_of(2, 31, 0x7FFFFFFF, 1)));
  CHECK_FALSE(unpack(bag_of(3, 31, 0x7FFFFFFF, 1)));  // word above 32 bits
  CHECK(unpack(bag_of(1, 0, 0, 0xFFFFFFFF)));
  CHECK_FALSE(unpack(bag_of(1, 0, 0, 0x100000000)));  // count above 32 bits
  CHECK(unpack(bag_of(kMaxBagWords, 0, 0, 1)));
  CHECK_FALSE(unpack(bag_of(kMaxBagWords + 1, 0, 0, 1)));
}

TEST_CASE("A keyframe's words survive the wire") {
  const KeyframeBow message{.id = {700, 41},
                            .stamp = 1403636584763555584,
                            .vocabulary = 0xFEDCBA9876543210ULL,
                            .words = {{3, 1}, {900, 4}},
                            .normalizer = 0.25};
  const auto encoded = encoded_by(700, message);
  const auto result = decoded(encoded);
  REQUIRE(result.value);
  CHECK(result.value->id == message.id);
  CHECK(result.value->stamp == message.stamp);
  CHECK(result.value->vocabulary == message.vocabulary);
  CHECK(result.value->words == message.words);
  CHECK(result.value->normalizer == message.normalizer);
}

TEST_CASE("A message that contradicts itself is refused with the reason") {
  using Message = Arrived<KeyframeBow>;
  const auto make = [] { return encoded_by<KeyframeBow>(7, {.id = {7, 1}, .words = {{3, 1}}}); };
  constexpr const char* kReason = "the normaliser is no score";
  check_refusals<KeyframeBow>(
      make, {{"of another robot", "a keyframe of another robot than the writer",
              [](Message& m) { m.writer.robot = 8; }},
             {"no words", "the words cannot be decoded", [](Message& m) { m.bag[0] = 0x00; }},
             {"no buffer", "words are missing or too many",
              [](Message& m) { m.wire.bag._buffer = nullptr; }},
             {"negative", kReason, [](Message& m) { m.wire.normalizer = -0.1F; }},
             {"above one", kReason, [](Message& m) { m.wire.normalizer = 1.1F; }},
             {"not a number", kReason, [](Message& m) { m.wire.normalizer = NAN; }}});
}

}  // namespace
}  // namespace km
