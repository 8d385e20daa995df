#pragma once

#include <team.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "modules/pose_graph/team_message_bytes.hpp"
#include "modules/pose_graph/team_messages.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// A message as it arrives over a link, with the robot that forwarded it.
struct TeamPacket {
  RobotId from = 0;
  std::shared_ptr<const TeamMessage> message;
};

/// Sent as TopicKind::kRequest: messages that a short outage of the link delays arrive later, the
/// newest of each key. After an outage of dds.lease_s they are discarded, and a robot that is
/// received again gets the state from scratch.
template <>
struct Codec<TeamPacket> {
  using Wire = km_wire_TeamPacket;
  static constexpr const char* kTopic = "team_packets";
  static constexpr std::uint16_t kVersion = 1;
  static constexpr std::size_t kMaxBytes = kMaxTeamMessageBytes + 64;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_TeamPacket_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> content;
  };
  static MessageKey key_of(const TeamPacket& packet);
  static Encoded encode(const TeamPacket& packet);
  static Decoded<TeamPacket> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
