#pragma once

#include <relay.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/relay/relay_endorsement.hpp"
#include "modules/relay/relay_message.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// An inlier set with its signature is the largest content.
inline constexpr std::size_t kMaxRelayContent = 800'000 + kEndorsementBytes;

/// Uses TopicKind::kRequest: the RelayStore sends a message again if a link is down for longer than
/// dds.lease_s.
template <>
struct Codec<RelayPacket> {
  using Wire = km_wire_RelayPacket;
  static constexpr const char* kTopic = "relay_packets";
  static constexpr std::uint16_t kVersion = 2;
  static constexpr std::size_t kMaxBytes = kMaxRelayContent + 64;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_RelayPacket_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> content;
  };
  static MessageKey key_of(const RelayPacket& packet);
  static Encoded encode(const RelayPacket& packet);
  static Decoded<RelayPacket> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
