#include "apps/lab/crowd/crowd_robot.hpp"

#include <random>

#include "modules/place_recognition/packed_bag.hpp"

namespace km {
namespace {

constexpr std::size_t kWordPoints = 110;  // median of pairs of EuRoC V1_01
// Share of the wrong candidates whose common words agree by chance
// (modules/loop_closure/README.md).
constexpr double kChance = 0.25;
constexpr double kKeyframePeriod_s = 3.0;

// A number in [0, 1) that depends on the pair only.
double draw(const KeyframeId& a, const KeyframeId& b) {
  std::seed_seq seed{std::uint32_t{a.robot}, a.index, std::uint32_t{b.robot}, b.index};
  std::mt19937 random(seed);
  return static_cast<double>(random()) / 4294967296.0;
}

}  // namespace

CrowdRobot::CrowdRobot(const CrowdWorld& world, const Vocabulary& vocabulary, RobotId self,
                       double verified_share, const CrowdMeter& meter)
    : world_(world),
      vocabulary_(vocabulary),
      self_(self),
      verified_share_(verified_share),
      meter_(meter),
      own_(PlaceRecognitionConfig{}, vocabulary.size()),
      policy_(LoopClosureConfig{}) {}

void CrowdRobot::add_own(const BagOfWords& bag, KeyframeIndex index) {
  work_.run(meter_, [&] {
    BowVector vector = vocabulary_.weigh(bag);
    const Stamp stamp = nanoseconds(kKeyframePeriod_s * index);
    (void)own_.search_own(vector, stamp);
    own_.add(std::move(vector), stamp);
  });
}

void CrowdRobot::receive(const KeyframeId& keyframe, std::span<const std::uint8_t> packed,
                         double normalizer, bool stores_bag) {
  ++findings_.bags;
  const CandidateSearch result =
      work_.run(meter_, [&] { return search(keyframe, packed, normalizer, stores_bag); });
  for (const PlaceCandidate& candidate : result.candidates) judge(keyframe, candidate);
}

CandidateSearch CrowdRobot::search(const KeyframeId& keyframe, std::span<const std::uint8_t> packed,
                                   double normalizer, bool stores_bag) {
  const BagOfWords bag = unpack(packed).value();
  if (stores_bag) stored_[keyframe] = {packed.begin(), packed.end()};
  std::vector<std::uint32_t> words;
  words.reserve(bag.size());
  for (const WordCount& entry : bag) words.push_back(entry.word);
  words_.put(keyframe, std::move(words));
  return own_.search(vocabulary_.weigh(bag), normalizer);
}

void CrowdRobot::judge(const KeyframeId& query, const PlaceCandidate& candidate) {
  const KeyframeId match{self_, static_cast<KeyframeIndex>(candidate.index)};
  const std::uint32_t place = world_.places(self_)[match.index];
  const bool is_true = world_.places(query.robot)[query.index] == place;
  ++(is_true ? findings_.true_candidates : findings_.false_candidates);
  if (is_true) findings_.found[place].insert(query);
  if (!requested_.contains(query)) {
    const auto decision = policy_.decide({.query = query,
                                          .match = match,
                                          .similarity = candidate.similarity,
                                          .support = candidate.support});
    if (decision != RequestPolicy::Decision::kRequest) return;
    ++(is_true ? findings_.true_requests : findings_.false_requests);
    request(query, is_true);
  }
  ++findings_.verifications;
  const bool verified = is_true && draw(query, match) < verified_share_;
  if (verified) {
    policy_.add_closure({match, query});
    ++findings_.closures[place];
    sent_.add(closure_bytes());
  }
  policy_.add_result(query, verified);
}

void CrowdRobot::request(const KeyframeId& query, bool is_true) {
  requested_.insert(query);
  sent_.add(request_bytes());
  received_.add(words_bytes(kWordPoints));
  if (!is_true && draw(query, {self_, 0}) >= kChance) return;
  sent_.add(request_bytes());
  received_.add(reply_bytes(kWordPoints));
}

}  // namespace km
