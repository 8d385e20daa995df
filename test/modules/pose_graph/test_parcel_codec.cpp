#include <catch2/catch.hpp>

#include "modules/pose_graph/parcel_codec.hpp"
#include "modules/pose_graph/team_message_bytes.hpp"

namespace km {
namespace {

constexpr TeamPeer kSelf{7, 70};
constexpr TeamPeer kFar{300, 3};

Codec<TeamParcel>::Encoded written(const TeamMessage& message, const TeamPeer& by) {
  auto encoded =
      Codec<TeamParcel>::encode({by.robot, std::make_shared<const TeamMessage>(message)});
  encoded.wire.header = {
      .version = Codec<TeamParcel>::kVersion, .robot = by.robot, .boot = by.boot, .number = 0};
  return encoded;
}

SessionLetter letter(const TeamPeer& sender, std::uint32_t number, RobotId to) {
  return {.sender = sender,
          .session = {kSelf, 1},
          .number = number,
          .to = to,
          .bytes = std::make_shared<const std::vector<std::uint8_t>>(100, std::uint8_t{5})};
}

TEST_CASE("A parcel arrives with who said it and who handed it over", "[pose_graph]") {
  const TeamPeer origin = GENERATE(kSelf, kFar);
  const auto sent = written(letter(origin, 130, 9), kSelf);
  CHECK(sent.wire.robot == 7);
  CHECK(sent.wire.origin == origin.robot);
  CHECK(sent.wire.kind == 3);
  CHECK(sent.wire.to == 9);
  CHECK(sent.wire.slot == 130 % 64);
  const auto arrived = Codec<TeamParcel>::decode(sent.wire);
  REQUIRE(arrived.value);
  CHECK(arrived.value->from == 7);
  const auto& heard = std::get<SessionLetter>(*arrived.value->message);
  CHECK(heard.sender == origin);
  CHECK(heard.number == 130);
  CHECK(heard.bytes->size() == 100);
}

TEST_CASE("Of what counts with its newest only, all of one origin has one key", "[pose_graph]") {
  const auto key = [](const TeamMessage& message) {
    const auto wire = written(message, kSelf).wire;
    return std::array<int, 4>{wire.origin, wire.kind, wire.to, wire.slot};
  };
  CHECK(key(TeamStatus{.sender = kFar, .number = 1, .frame = {}}) ==
        std::array<int, 4>{300, 0, 0, 0});
  CHECK(key(TeamStatus{.sender = kFar, .number = 2, .frame = {}}) ==
        std::array<int, 4>{300, 0, 0, 0});
  CHECK(key(Session{.id = {kFar, 4}, .plan = {}}) == std::array<int, 4>{300, 1, 0, 0});
  CHECK(key(MemberPoses{.sender = kFar, .stage = 1}) == std::array<int, 4>{300, 2, 0, 0});
  CHECK(key(letter(kFar, 1, 9)) != key(letter(kFar, 2, 9)));
  CHECK(key(letter(kFar, 1, 9)) != key(letter(kFar, 1, 8)));
  SessionLetter receipt = letter(kFar, 1, 9);
  receipt.bytes = std::make_shared<const std::vector<std::uint8_t>>();
  CHECK(key(receipt) == std::array<int, 4>{300, 3, 9, 64});
}

TEST_CASE("A parcel that contradicts itself is refused", "[pose_graph]") {
  auto sent = written(letter(kSelf, 1, 9), kSelf);
  REQUIRE(Codec<TeamParcel>::decode(sent.wire).value);
  SECTION("written by another robot") {
    sent.wire.header.robot = 8;
  }
  SECTION("said by a former process") {
    sent.wire.header.boot = 71;
  }
  SECTION("another origin") {
    sent.wire.origin = 8;
  }
  SECTION("another kind") {
    sent.wire.kind = 0;
  }
  SECTION("another addressee") {
    sent.wire.to = 8;
  }
  SECTION("another slot") {
    sent.wire.slot = 2;
  }
  SECTION("no content") {
    sent.wire.content._length = 0;
  }
  SECTION("content that is missing") {
    sent.wire.content._buffer = nullptr;
  }
  SECTION("content that is cut short") {
    sent.wire.content._length = 5;
  }
  SECTION("content longer than any") {
    sent.wire.content._length = kMaxTeamMessageBytes + 1;
  }
  const auto arrived = Codec<TeamParcel>::decode(sent.wire);
  CHECK_FALSE(arrived.value);
  CHECK(arrived.refusal != nullptr);
}

}  // namespace
}  // namespace km
