#include "runtime/overlay/overlay_codec.hpp"

#include <memory>
#include <utility>

#include "modules/core/io/bytes.hpp"

namespace km {
namespace {

// Bits of the first byte; the others are the stream.
constexpr std::uint8_t kStreamBits = 0x0F;
constexpr std::uint8_t kSignedBit = 0x10;
constexpr std::uint8_t kOwnBit = 0x20;

constexpr bool is_numbered(OverlayStream stream) {
  return stream != OverlayStream::kIntroduction;
}
constexpr bool is_addressed(OverlayStream stream) {
  return is_call(stream) || is_reliable(stream);
}

}  // namespace

MessageKey key_of(const OverlayMessage& message) {
  const auto stream = static_cast<std::uint64_t>(message.stream);
  if (is_state(message.stream)) return message_key({stream, message.origin.robot});
  return message_key(
      {stream, message.origin.robot, message.origin.boot, message.to, message.number});
}

std::vector<std::uint8_t> encode(const OverlayPacket& packet) {
  const OverlayMessage& message = *packet.message;
  ByteWriter out;
  out.u8(static_cast<std::uint8_t>(static_cast<std::uint8_t>(message.stream) |
                                   (message.is_signed ? kSignedBit : 0U) |
                                   (packet.is_own ? kOwnBit : 0U)));
  if (!packet.is_own) {
    out.varint(message.origin.robot);
    out.u64(message.origin.boot);
  }
  if (is_numbered(message.stream)) out.varint(message.number);
  if (is_addressed(message.stream)) out.varint(message.to);
  if (is_reliable(message.stream)) out.u64(message.to_boot);
  if (is_call(message.stream)) out.u8(message.hops);
  out.bytes(message.content);
  return out.release();
}

Decoded<OverlayPacket> decode_overlay_packet(std::span<const std::uint8_t> bytes,
                                             const TeamPeer& writer, OverlayLane lane) {
  using Result = Decoded<OverlayPacket>;
  ByteReader in(bytes);
  OverlayMessage message;
  const std::uint8_t head = in.u8();
  if ((head & ~(kSignedBit | kOwnBit)) > static_cast<unsigned>(OverlayStream::kInlierSet))
    return Result::refuse("unknown stream");
  message.stream = static_cast<OverlayStream>(head & kStreamBits);
  message.is_signed = (head & kSignedBit) != 0;
  const bool is_own = (head & kOwnBit) != 0;
  message.origin = is_own ? writer : TeamPeer{in.varint_as<RobotId>(), in.u64()};
  if (is_numbered(message.stream)) message.number = in.varint_as<std::uint32_t>();
  if (is_addressed(message.stream)) message.to = in.varint_as<RobotId>();
  if (is_reliable(message.stream)) message.to_boot = in.u64();
  if (is_call(message.stream)) message.hops = in.u8();
  if (in.failed()) return Result::refuse("truncated, or a number is out of range");
  const auto content = in.bytes(in.left());
  if (lane_of(message.stream) != lane) return Result::refuse("stream of another topic");
  if (message.origin.boot == 0) return Result::refuse("its boot id is 0");
  if (!is_own && message.origin.robot == writer.robot)
    return Result::refuse("its origin is a former process of its sender");
  if (content.size() > max_content(lane)) return Result::refuse("the content is too long");
  if (message.is_signed && content.size() < kEndorsementBytes)
    return Result::refuse("shorter than its signature");
  if (message.stream == OverlayStream::kIntroduction && !parse_introduction(content))
    return Result::refuse("introduction without a robot name");
  message.content.assign(content.begin(), content.end());
  return Result::accept(
      {writer.robot, std::make_shared<const OverlayMessage>(std::move(message)), is_own});
}

}  // namespace km
