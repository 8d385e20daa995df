#include <catch2/catch.hpp>

#include "modules/pose_graph/packet_codec.hpp"
#include "modules/pose_graph/team_message_bytes.hpp"
#include "test/support/corrupted_message.hpp"

namespace km {
namespace {

constexpr TeamPeer kSelf{7, 70};
constexpr TeamPeer kFar{300, 3};

Arrived<TeamPacket> written(const TeamMessage& message, const TeamPeer& by) {
  return encoded_by<TeamPacket>(TeamPeer{by.robot, by.boot},
                                {by.robot, std::make_shared<const TeamMessage>(message)});
}

ReliableMessage reliable(const TeamPeer& sender, std::uint32_t number, RobotId to) {
  return {.sender = sender,
          .session = {kSelf, 1},
          .number = number,
          .to = to,
          .bytes = std::make_shared<const std::vector<std::uint8_t>>(100, std::uint8_t{5})};
}

TEST_CASE("A message arrives with its origin and the robot that forwarded it", "[pose_graph]") {
  const TeamPeer origin = GENERATE(kSelf, kFar);
  const auto sent = written(reliable(origin, 130, 9), kSelf);
  const auto arrived = decoded(sent);
  REQUIRE(arrived.value);
  CHECK(arrived.value->from == 7);
  const auto& received = std::get<ReliableMessage>(*arrived.value->message);
  CHECK(received.sender == origin);
  CHECK(received.number == 130);
  CHECK(received.bytes->size() == 100);
}

TEST_CASE("Messages of which only the newest counts have one key per origin and kind",
          "[pose_graph]") {
  const auto key = [](const TeamMessage& message) {
    return Codec<TeamPacket>::key_of({7, std::make_shared<const TeamMessage>(message)});
  };
  const auto status = [&](const TeamPeer& sender, std::uint32_t number) {
    return key(TeamStatus{.sender = sender, .number = number, .frame = {}});
  };
  CHECK(status(kFar, 1) == status(kFar, 2));
  CHECK(status(kFar, 1) != status(kSelf, 1));
  CHECK(key(Session{.id = {kFar, 4}, .plan = {}}) == key(Session{.id = {kFar, 5}, .plan = {}}));
  CHECK(key(Session{.id = {kFar, 4}, .plan = {}}) != status(kFar, 1));
  CHECK(key(MemberPoses{.sender = kFar, .stage = MemberStage::kSolved}) ==
        key(MemberPoses{.sender = kFar, .stage = MemberStage::kFailed}));
}

TEST_CASE("Reliable messages replace each other after 64 numbers, and acknowledgements at once",
          "[pose_graph]") {
  const auto key = [](const ReliableMessage& message) {
    return Codec<TeamPacket>::key_of({7, std::make_shared<const TeamMessage>(message)});
  };
  CHECK(key(reliable(kFar, 1, 9)) != key(reliable(kFar, 2, 9)));
  CHECK(key(reliable(kFar, 1, 9)) != key(reliable(kFar, 1, 8)));
  CHECK(key(reliable(kFar, 1, 9)) == key(reliable(kFar, 65, 9)));
  ReliableMessage receipt = reliable(kFar, 1, 9);
  receipt.bytes = std::make_shared<const std::vector<std::uint8_t>>();
  ReliableMessage next = receipt;
  next.number = 2;
  CHECK(key(receipt) == key(next));
  CHECK(key(receipt) != key(reliable(kFar, 64, 9)));
}

TEST_CASE("An inconsistent message is refused", "[pose_graph]") {
  auto sent = written(reliable(kSelf, 1, 9), kSelf);
  REQUIRE(decoded(sent).value);
  SECTION("sent by a former process") {
    sent.writer.boot = 71;
  }
  SECTION("no content") {
    sent.wire.content._length = 0;
  }
  SECTION("missing content") {
    sent.wire.content._buffer = nullptr;
  }
  SECTION("truncated content") {
    sent.wire.content._length = 5;
  }
  SECTION("content beyond the limit") {
    sent.wire.content._length = kMaxTeamMessageBytes + 1;
  }
  const auto arrived = decoded(sent);
  CHECK_FALSE(arrived.value);
  CHECK(arrived.refusal != nullptr);
}

}  // namespace
}  // namespace km
