#include <catch2/catch.hpp>

#include <cstring>
#include <random>

#include "modules/place_recognition/place_recognition_codec.hpp"

namespace km {
namespace {

constexpr std::uint32_t kMax = ~0U;

TEST_CASE("A bag of words survives packing", "[place_recognition]") {
  const BagOfWords bag = GENERATE(values<BagOfWords>({{},
                                                      {{0, 1}},
                                                      {{0, 2}, {1, 1}, {2, 3}},
                                                      {{kMax, kMax}},
                                                      {{0, kMax}, {kMax - 1, 1}, {kMax, 2}}}));
  CHECK(unpack(pack(bag)) == bag);
}

TEST_CASE("Random bags survive packing at little more than a byte a word", "[place_recognition]") {
  const auto seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::geometric_distribution<std::uint32_t> gap(1.0 / 30.0);
  std::geometric_distribution<std::uint32_t> more(0.9);
  BagOfWords bag;
  for (std::uint32_t word = 0; bag.size() < 1000; ++word) {
    word += gap(rng);
    bag.push_back({word, 1 + more(rng)});
  }
  const std::vector<std::uint8_t> bytes = pack(bag);
  CHECK(unpack(bytes) == bag);
  CHECK(bytes.size() < 1500);
}

TEST_CASE("Bytes that are no bag are refused", "[place_recognition]") {
  using Bytes = std::vector<std::uint8_t>;
  CHECK_FALSE(unpack(Bytes{0x80}));                                // ends inside a number
  CHECK_FALSE(unpack(Bytes{0x03}));                                // ends before the count
  CHECK_FALSE(unpack(Bytes{0x80, 0x80, 0x80, 0x80, 0x80, 0x00}));  // longer than 35 bits
  CHECK_FALSE(unpack(Bytes{0x01, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F}));  // count above 32 bits
  CHECK_FALSE(unpack(Bytes{0xFE, 0xFF, 0xFF, 0xFF, 0x1F, 0x00}));  // word above 32 bits
  CHECK(unpack(Bytes(kMaxBagWords, 0x00)).has_value());
  CHECK_FALSE(unpack(Bytes(kMaxBagWords + 1, 0x00)));
}

TEST_CASE("Random bytes never give words that are not ascending", "[place_recognition]") {
  std::mt19937 rng(1);
  int accepted = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<std::uint8_t> bytes(rng() % 40U);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(rng());
    const auto bag = unpack(bytes);
    if (!bag) continue;
    ++accepted;
    for (std::size_t i = 0; i < bag->size(); ++i) {
      CHECK((*bag)[i].count > 0);
      if (i > 0) CHECK((*bag)[i - 1].word < (*bag)[i].word);
    }
  }
  CHECK(accepted > 0);
}

TEST_CASE("A keyframe's words survive the wire", "[place_recognition]") {
  const KeyframeBow message{.id = {700, 41},
                            .stamp = 1403636584763555584,
                            .vocabulary = 0xFEDCBA9876543210ULL,
                            .words = {{3, 1}, {900, 4}}};
  auto encoded = Codec<KeyframeBow>::encode(message);
  auto moved = std::move(encoded);  // the wire type points into its owner
  moved.wire.header.robot = 700;
  const auto decoded = Codec<KeyframeBow>::decode(moved.wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->id == message.id);
  CHECK(decoded.value->stamp == message.stamp);
  CHECK(decoded.value->vocabulary == message.vocabulary);
  CHECK(decoded.value->words == message.words);
}

TEST_CASE("A message that contradicts itself is refused with the reason", "[place_recognition]") {
  auto encoded = Codec<KeyframeBow>::encode({.id = {7, 1}, .words = {{3, 1}}});
  encoded.wire.header.robot = 8;
  CHECK(std::strstr(Codec<KeyframeBow>::decode(encoded.wire).refusal, "another robot") != nullptr);
  encoded.wire.header.robot = 7;
  encoded.words[0] = 0x80;
  CHECK(std::strstr(Codec<KeyframeBow>::decode(encoded.wire).refusal, "decoded") != nullptr);
  encoded.wire.words._buffer = nullptr;
  CHECK(std::strstr(Codec<KeyframeBow>::decode(encoded.wire).refusal, "missing") != nullptr);
}

}  // namespace
}  // namespace km
