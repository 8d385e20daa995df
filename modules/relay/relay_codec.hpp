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
struct Codec<RelayParcel> {
  using Wire = km_wire_RelayParcel;
  static constexpr const char* kTopic = "relay_parcels";
  static constexpr std::uint16_t kVersion = 2;
  static constexpr std::size_t kMaxBytes = kMaxRelayContent + 64;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_RelayParcel_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> content;
  };
  static MessageKey key_of(const RelayParcel& parcel);
  static Encoded encode(const RelayParcel& parcel);
  static Decoded<RelayParcel> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
