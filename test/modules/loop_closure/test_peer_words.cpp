#include <catch2/catch.hpp>

#include "modules/loop_closure/peer_words.hpp"

namespace km {
namespace {

using Words = std::vector<std::uint32_t>;

TEST_CASE("Words of peers are kept by keyframe, the newest of each", "[loop_closure]") {
  PeerWords words;
  words.put({7, 1}, {1, 2});
  words.put({8, 1}, {3});
  words.put({7, 1}, {5, 6, 7});
  REQUIRE(words.find({7, 1}) != nullptr);
  CHECK(*words.find({7, 1}) == Words{5, 6, 7});
  CHECK(*words.find({8, 1}) == Words{3});
  CHECK(words.find({7, 2}) == nullptr);
  CHECK(words.find({9, 1}) == nullptr);
}

TEST_CASE("A peer that sends words without end loses its own oldest", "[loop_closure]") {
  const std::size_t size = GENERATE(0U, 1000U, 65536U);
  PeerWords words;
  words.put({8, 0}, {1});
  // Twice the words that are kept, most of them added twice.
  const auto count = static_cast<KeyframeIndex>(2 * PeerWords::kMaxWordsPerRobot / (size + 32));
  for (KeyframeIndex i = 0; i < count; ++i)
    for (int k = 0; k < 2; ++k) words.put({7, i}, Words(size, i));
  KeyframeIndex kept = 0;
  for (KeyframeIndex i = 0; i < count; ++i) kept += words.find({7, i}) != nullptr ? 1 : 0;
  CHECK(kept * (size + 32) <= PeerWords::kMaxWordsPerRobot);
  CHECK((kept + 1) * (size + 32) > PeerWords::kMaxWordsPerRobot);
  CHECK(words.find({7, count - 1}) != nullptr);
  CHECK(words.find({7, 0}) == nullptr);
  CHECK(words.find({8, 0}) != nullptr);
}

}  // namespace
}  // namespace km
