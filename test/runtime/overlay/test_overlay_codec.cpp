#include <catch2/catch.hpp>

#include "runtime/overlay/overlay.hpp"
#include "runtime/overlay/overlay_codec.hpp"
#include "test/support/corrupted_message.hpp"

namespace km {
namespace {

using TeamLanePacket = LanePacket<OverlayLane::kTeam>;
using PlacesLanePacket = LanePacket<OverlayLane::kPlaces>;

constexpr TeamPeer kSelf{7, 70};
constexpr TeamPeer kFar{300, 3};

OverlayMessage message_of(OverlayStream stream, const TeamPeer& origin = kFar) {
  OverlayMessage message{.stream = stream, .origin = origin, .content = {'a', 'b', 'c'}};
  if (stream != OverlayStream::kIntroduction) message.number = 130;
  if (is_call(stream) || is_reliable(stream)) message.to = 9;
  if (is_call(stream)) message.hops = 2;
  if (is_reliable(stream)) message.to_boot = 90;
  return message;
}

OverlayPacket packet_of(OverlayMessage message) {
  const bool is_own = message.origin == kSelf;
  return {9, std::make_shared<const OverlayMessage>(std::move(message)), is_own};
}

template <typename Packet>
OverlayMessage round_trip(const OverlayMessage& message) {
  const auto arrived = decoded(encoded_by<Packet>(kSelf, {packet_of(message)}));
  REQUIRE(arrived.value);
  CHECK(arrived.value->neighbour == kSelf.robot);
  return *arrived.value->message;
}

std::size_t head_bytes(const OverlayMessage& message) {
  return encode(packet_of(message)).size() - message.content.size();
}

}  // namespace

TEST_CASE("A message of the overlay arrives unchanged, from its origin or forwarded", "[overlay]") {
  const TeamPeer origin = GENERATE(kSelf, kFar);
  for (int k = 0; k <= static_cast<int>(OverlayStream::kInlierSet); ++k) {
    CAPTURE(k);
    OverlayMessage message = message_of(static_cast<OverlayStream>(k), origin);
    const auto check = [&] {
      if (lane_of(message.stream) == OverlayLane::kTeam)
        CHECK(round_trip<TeamLanePacket>(message) == message);
      else
        CHECK(round_trip<PlacesLanePacket>(message) == message);
    };
    check();
    if (message.stream == OverlayStream::kIntroduction) continue;
    message.is_signed = true;
    message.content.resize(kEndorsementBytes);
    check();
  }
}

TEST_CASE("The head of a message takes few bytes", "[overlay]") {
  CHECK(head_bytes(message_of(OverlayStream::kTeamStatus, kSelf)) == 1 + 2);
  CHECK(head_bytes(message_of(OverlayStream::kSolver, kSelf)) == 1 + 2 + 1 + 1);
  CHECK(head_bytes(message_of(OverlayStream::kTeamStatus)) == 1 + 2 + 8 + 2);
}

TEST_CASE("States have one key per origin and stream, other messages one each", "[overlay]") {
  const auto key = [](OverlayStream stream, const TeamPeer& origin, std::uint32_t number,
                      RobotId to = 9) {
    return key_of(OverlayMessage{.stream = stream, .origin = origin, .to = to, .number = number});
  };
  using enum OverlayStream;
  CHECK(key(kTeamStatus, kFar, 1) == key(kTeamStatus, kFar, 2));
  CHECK(key(kTeamStatus, kFar, 1) != key(kTeamStatus, kSelf, 1));
  CHECK(key(kTeamStatus, kFar, 1) != key(kSession, kFar, 1));
  for (const OverlayStream stream : {kSolver, kRequest, kReply, kWords, kBag, kClosure}) {
    CHECK(key(stream, kFar, 1) == key(stream, kFar, 1));
    CHECK(key(stream, kFar, 1) != key(stream, kFar, 2));
    CHECK(key(stream, kFar, 1) != key(stream, kFar, 1, 8));
    CHECK(key(stream, kFar, 1) != key(stream, kSelf, 1));
  }
}

TEST_CASE("An inconsistent message of the overlay is refused", "[overlay]") {
  const auto refusal_of = [](const OverlayMessage& message) -> std::string {
    const auto result = decoded(encoded_by<PlacesLanePacket>(kSelf, {packet_of(message)}));
    return result.value ? "" : result.refusal;
  };
  OverlayMessage message = message_of(OverlayStream::kReply);
  REQUIRE(refusal_of(message).empty());
  SECTION("stream") {
    message.stream = static_cast<OverlayStream>(static_cast<int>(OverlayStream::kInlierSet) + 1);
    CHECK(refusal_of(message) == "unknown stream");
  }
  SECTION("lane") {
    CHECK(refusal_of(message_of(OverlayStream::kSession)) == "stream of another topic");
  }
  SECTION("boot") {
    message.origin.boot = 0;
    CHECK(refusal_of(message) == "its boot id is 0");
  }
  SECTION("origin") {
    message.origin = {kSelf.robot, 71};
    CHECK(refusal_of(message) == "its origin is a former process of its sender");
  }
  SECTION("size") {
    message.content.resize(max_content(OverlayLane::kPlaces) + 1);
    CHECK(refusal_of(message) == "the content is too long");
    message.content.resize(max_content(OverlayLane::kPlaces) + 100);
    CHECK(refusal_of(message) == "the content is missing or too long");
  }
  SECTION("signature") {
    message.is_signed = true;
    CHECK(refusal_of(message) == "shorter than its signature");
  }
}

TEST_CASE("Reports of links are restored, and malformed ones are refused", "[overlay]") {
  const std::vector<TeamPeer> links{{1, 5}, {200, 6}, {60000, 7}};
  CHECK(decode_links(encode_links(links)) == links);
  CHECK(decode_links({}) == std::vector<TeamPeer>());
  std::vector<std::uint8_t> bytes = encode_links(links);
  bytes.pop_back();
  CHECK_FALSE(decode_links(bytes));
  CHECK_FALSE(decode_links(encode_links({{2, 5}, {1, 6}})));
  CHECK_FALSE(decode_links(encode_links({{2, 5}, {2, 6}})));
  std::vector<TeamPeer> many;
  for (std::size_t k = 0; k <= kMaxTeam; ++k) many.push_back({static_cast<RobotId>(k), 1});
  CHECK_FALSE(decode_links(encode_links(many)));
}

}  // namespace km
