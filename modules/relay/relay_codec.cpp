#include "modules/relay/relay_codec.hpp"

#include <memory>
#include <utility>

namespace km {

MessageKey Codec<RelayPacket>::key_of(const RelayPacket& packet) {
  const RelayMessage& message = *packet.message;
  return message_key({static_cast<std::uint64_t>(message.kind), message.origin.robot,
                      message.origin.boot, message.to, message.number});
}

Codec<RelayPacket>::Encoded Codec<RelayPacket>::encode(const RelayPacket& packet) {
  const RelayMessage& message = *packet.message;
  Encoded encoded;
  encoded.content = message.content;
  Wire& wire = encoded.wire;
  wire.kind = static_cast<std::uint8_t>(message.kind);
  wire.hops = message.hops;
  wire.origin = message.origin.robot;
  wire.to = message.to;
  wire.boot = message.origin.boot;
  wire.number = message.number;
  borrow(wire.content, encoded.content);
  wire.to_boot = message.to_boot;
  return encoded;
}

Decoded<RelayPacket> Codec<RelayPacket>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<RelayPacket>;
  if (wire.kind > static_cast<std::uint8_t>(RelayKind::kReply))
    return Result::refuse("a kind that is not known");
  const auto kind = static_cast<RelayKind>(wire.kind);
  if (wire.boot == 0) return Result::refuse("of no process");
  if (wire.origin == writer.robot && wire.boot != writer.boot)
    return Result::refuse("its origin is a former process of its sender");
  const auto content = elements_of(wire.content, kMaxRelayContent);
  if (!content) return Result::refuse("the content is missing or too long");
  if (kind == RelayKind::kIntroduction && !parse_introduction(*content))
    return Result::refuse("a name that no robot has");
  return Result::accept({writer.robot, std::make_shared<const RelayMessage>(RelayMessage{
                                           .kind = kind,
                                           .origin = {wire.origin, wire.boot},
                                           .to = wire.to,
                                           .to_boot = wire.to_boot,
                                           .number = wire.number,
                                           .hops = wire.hops,
                                           .content = {content->begin(), content->end()}})});
}

}  // namespace km
