#include <catch2/catch.hpp>

#include "modules/outlier_rejection/outlier_rejection_codec.hpp"

namespace km {
namespace {

const InlierSet kSet{.a = 3,
                     .b = 700,
                     .version = 12,
                     .closures = {{{3, 0}, {700, 9}}, {{3, 5}, {700, 1}}, {{3, 5}, {700, 4}}}};

// As it arrives: with the writer's header.
Codec<InlierSet>::Encoded received(const InlierSet& set) {
  auto encoded = Codec<InlierSet>::encode(set);
  encoded.wire.header.robot = set.a;
  return encoded;
}

TEST_CASE("An inlier set survives the wire", "[codec]") {
  const auto encoded = received(kSet);
  const Decoded<InlierSet> decoded = Codec<InlierSet>::decode(encoded.wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->a == kSet.a);
  CHECK(decoded.value->b == kSet.b);
  CHECK(decoded.value->version == kSet.version);
  CHECK(decoded.value->closures == kSet.closures);
}

TEST_CASE("An empty set and one inside a robot survive the wire", "[codec]") {
  InlierSet set{.a = 5, .b = 5, .version = 1, .closures = {}};
  CHECK(Codec<InlierSet>::decode(received(set).wire).value);
  set.closures = {{{5, 2}, {5, 9}}};
  CHECK(Codec<InlierSet>::decode(received(set).wire).value);
}

TEST_CASE("An inlier set that cannot be is refused", "[codec]") {
  InlierSet set = kSet;
  const char* reason = nullptr;
  auto encoded = received(kSet);
  SECTION("descending pair") {
    std::swap(encoded.wire.a, encoded.wire.b);
    reason = "the pair is not in ascending order";
  }
  SECTION("written by the higher robot") {
    encoded.wire.header.robot = 700;
    reason = "decided by another robot than the lower";
  }
  SECTION("closure of a third robot") {
    encoded.closures[1].to.robot = 4;
    reason = "a closure of another pair";
  }
  SECTION("closure inside one of two robots") {
    encoded.closures[0].to.robot = 3;
    reason = "a closure of another pair";
  }
  SECTION("repeated closure") {
    encoded.closures[1] = encoded.closures[0];
    reason = "closures are not ascending";
  }
  SECTION("descending closures") {
    std::swap(encoded.closures[0], encoded.closures[2]);
    reason = "closures are not ascending";
  }
  SECTION("a second name of a closure") {
    std::swap(encoded.closures[1].from, encoded.closures[1].to);
    reason = "a closure is named by its higher end first";
  }
  SECTION("claimed without being there") {
    encoded.wire.closures._buffer = nullptr;
    reason = "closures are missing or too many";
  }
  SECTION("a length without end") {
    encoded.wire.closures._length = 0xffffffffU;
    reason = "closures are missing or too many";
  }
  SECTION("a keyframe with itself") {
    set = {.a = 5, .b = 5, .version = 1, .closures = {{{5, 9}, {5, 9}}}};
    encoded = received(set);
    reason = "a closure from a keyframe to itself";
  }
  const Decoded<InlierSet> decoded = Codec<InlierSet>::decode(encoded.wire);
  CHECK_FALSE(decoded.value);
  CHECK(std::string(decoded.refusal) == reason);
}

}  // namespace
}  // namespace km
