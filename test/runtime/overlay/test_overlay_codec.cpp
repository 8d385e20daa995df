#include "runtime/overlay/overlay.hpp"
#include "runtime/overlay/overlay_codec.hpp"
#include "test/support/corrupted_message.hpp"
#include "test/support/test.hpp"

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

}  // namespace

TEST_CASE("A message of the overlay arrives unchanged, from its origin or forwarded") {
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

TEST_CASE("An inconsistent message of the overlay is refused") {
  const auto refusal_of = [](const OverlayMessage& message) -> std::string {
    const auto result = decoded(encoded_by<PlacesLanePacket>(kSelf, {packet_of(message)}));
    return result.value ? "" : result.refusal;
  };
  const OverlayMessage good = message_of(OverlayStream::kReply);
  REQUIRE(refusal_of(good).empty());
  CHECK(refusal_of(message_of(OverlayStream::kSession)) == "stream of another topic");
  using Case = std::pair<void (*)(OverlayMessage&), const char*>;
  constexpr std::size_t kMost = max_content(OverlayLane::kPlaces);
  const auto [change, reason] = GENERATE_COPY(values<Case>(
      {{[](auto& its) { its.stream = static_cast<OverlayStream>(99); }, "unknown stream"},
       {[](auto& its) { its.origin.boot = 0; }, "its boot id is 0"},
       {[](auto& its) {
          its.origin = {kSelf.robot, 71};
        },
        "its origin is a former process of its sender"},
       {[](auto& its) { its.content.resize(kMost + 1); }, "the content is too long"},
       {[](auto& its) { its.content.resize(kMost + 100); }, "the content is missing or too long"},
       {[](auto& its) { its.is_signed = true; }, "shorter than its signature"}}));
  OverlayMessage message = good;
  change(message);
  CHECK(refusal_of(message) == reason);
}

TEST_CASE("Reports of links are restored, and malformed ones are refused") {
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
