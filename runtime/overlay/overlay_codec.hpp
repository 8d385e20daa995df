#pragma once

#include <overlay.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/decoded.hpp"
#include "runtime/dds/codec.hpp"
#include "runtime/overlay/endorsement.hpp"
#include "runtime/overlay/overlay_message.hpp"

namespace km {

/// Packets with one priority on the network: a lane is a topic between robots.
enum class OverlayLane {
  kTeam,   ///< States, their introductions, and messages of solvers.
  kPlaces  ///< Bags, requests, replies, closures and inlier sets of robots out of range.
};
[[nodiscard]] constexpr OverlayLane lane_of(OverlayStream stream) {
  return stream <= OverlayStream::kSolver ? OverlayLane::kTeam : OverlayLane::kPlaces;
}

template <OverlayLane kLane>
struct LanePacket : OverlayPacket {};

/// The largest contents are public poses and inlier sets.
[[nodiscard]] constexpr std::size_t max_content(OverlayLane lane) {
  return (lane == OverlayLane::kTeam ? std::size_t{1} << 24U : 800'000U) + kEndorsementBytes;
}

/// Encodes a packet: the stream of its message, its members as varints, then its content. The robot
/// and the boot id of the origin are omitted if the sender is the origin: its envelope states them.
[[nodiscard]] std::vector<std::uint8_t> encode(const OverlayPacket& packet);
/// Decodes untrusted bytes that `writer` has sent on `lane`.
[[nodiscard]] Decoded<OverlayPacket> decode_overlay_packet(std::span<const std::uint8_t> bytes,
                                                           const TeamPeer& writer,
                                                           OverlayLane lane);
/// Messages with one key replace each other at their sender. States have one key for each origin
/// and stream.
[[nodiscard]] MessageKey key_of(const OverlayMessage& message);

/// Uses TopicKind::kRequest: an Overlay sends a message again if a link is down for longer than
/// dds.lease_s.
template <OverlayLane kLane>
struct Codec<LanePacket<kLane>> : WireFormat<km_wire_OverlayPacket, km_wire_OverlayPacket_desc> {
  static constexpr const char* kTopic =
      kLane == OverlayLane::kTeam ? "overlay_team" : "overlay_places";
  static constexpr std::size_t kMaxBytes = max_content(kLane) + 64;

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> content;
  };
  static MessageKey key_of(const LanePacket<kLane>& packet) { return km::key_of(*packet.message); }
  static Encoded encode(const LanePacket<kLane>& packet) {
    Encoded encoded;
    encoded.content = km::encode(packet);
    borrow(encoded.wire.content, encoded.content);
    return encoded;
  }
  static Decoded<LanePacket<kLane>> decode(const Wire& wire, const TeamPeer& writer) {
    using Result = Decoded<LanePacket<kLane>>;
    const auto content = elements_of(wire.content, kMaxBytes);
    if (!content) return Result::refuse("the content is missing or too long");
    auto packet = decode_overlay_packet(*content, writer, kLane);
    if (!packet.value) return Result::refuse(packet.refusal);
    return Result::accept({std::move(*packet.value)});
  }
};

}  // namespace km
