#include "modules/pose_graph/packet_codec.hpp"

#include <utility>

#include "modules/pose_graph/team_message_bytes.hpp"
#include "runtime/dds/codec.hpp"

namespace km {
namespace {

// Number of reliable messages of one origin to one receiver that may be on one link at a time. A
// few would suffice, because solvers wait for answers. A repetition replaces its former copy.
constexpr std::uint32_t kReliableSlots = 64;
constexpr std::uint32_t kReceiptSlot = 64;  // acknowledgements without bytes: the newest counts

}  // namespace

// Distinguishes messages that must not replace each other. The newest status, session or public
// poses of an origin count; reliable messages have a ring for each pair of origin and receiver.
MessageKey Codec<TeamPacket>::key_of(const TeamPacket& packet) {
  const TeamMessage& message = *packet.message;
  const auto* reliable = std::get_if<ReliableMessage>(&message);
  if (reliable == nullptr) return message_key({origin_of(message).robot, message.index()});
  const bool is_receipt = !reliable->bytes || reliable->bytes->empty();
  const std::uint32_t slot = is_receipt ? kReceiptSlot : reliable->number % kReliableSlots;
  return message_key({origin_of(message).robot, message.index(), reliable->to, slot});
}

Codec<TeamPacket>::Encoded Codec<TeamPacket>::encode(const TeamPacket& packet) {
  Encoded encoded;
  encoded.content = km::encode(*packet.message);
  borrow(encoded.wire.content, encoded.content);
  return encoded;
}

Decoded<TeamPacket> Codec<TeamPacket>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<TeamPacket>;
  const auto content = elements_of(wire.content, kMaxTeamMessageBytes);
  if (!content) return Result::refuse("the content is missing or too long");
  Decoded<TeamMessage> message = decode_team_message(*content);
  if (!message.value) return Result::refuse(message.refusal);
  const TeamPeer origin = origin_of(*message.value);
  if (origin.robot == writer.robot && origin.boot != writer.boot)
    return Result::refuse("written by a former process of the robot that sends it");
  return Result::accept(
      {writer.robot, std::make_shared<const TeamMessage>(std::move(*message.value))});
}

}  // namespace km
