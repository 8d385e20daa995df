#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <random>

#include "modules/place_recognition/packed_bits.hpp"
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

TEST_CASE("Random bags survive packing at about six bits a word", "[place_recognition]") {
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
  // A gap has log2(e (1 + mean)) bits of information, or less; the code may add half a bit, and
  // half a bit is for rounding of the mean. Of ten words nine cost one bit for their count.
  const double bits = std::log2(std::exp(1.0) * (1.0 + mean_gap)) + 1.0 + 1.3;
  CHECK(8.0 * static_cast<double>(bytes.size()) < 1000.0 * bits);
}

TEST_CASE("Bytes that are no bag are refused", "[place_recognition]") {
  using Bytes = std::vector<std::uint8_t>;
  const Bytes good = pack({{3, 1}, {900, 4}, {70000, 1}});
  REQUIRE(unpack(good));
  CHECK_FALSE(unpack(Bytes{}));
  for (std::size_t size = 0; size < good.size(); ++size)
    CHECK_FALSE(unpack(std::span(good).first(size)));
  Bytes longer = good;
  longer.push_back(0x00);
  CHECK_FALSE(unpack(longer));  // goes on after the last word
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
  encoded.bag[0] = 0x00;
  CHECK(std::strstr(Codec<KeyframeBow>::decode(encoded.wire).refusal, "decoded") != nullptr);
  encoded.wire.bag._buffer = nullptr;
  CHECK(std::strstr(Codec<KeyframeBow>::decode(encoded.wire).refusal, "missing") != nullptr);
}

}  // namespace
}  // namespace km
