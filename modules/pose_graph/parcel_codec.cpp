#include "modules/pose_graph/parcel_codec.hpp"

#include <utility>

#include "modules/pose_graph/team_message_bytes.hpp"
#include "runtime/dds/codec.hpp"

namespace km {
namespace {

// Of one origin to one addressee, letters that may be on one link at a time. Solvers wait for
// answers, so that a few would do. A letter that is sent again takes the place of its former copy.
constexpr std::uint32_t kLetterSlots = 64;
constexpr std::uint8_t kReceiptSlot = 64;  // for letters without bytes: the newest counts

// All of it but the robot that hands it over.
void set_key(const TeamMessage& message, km_wire_TeamParcel& wire) {
  wire.origin = origin_of(message).robot;
  wire.kind = static_cast<std::uint8_t>(message.index());
  if (const auto* letter = std::get_if<SessionLetter>(&message)) {
    wire.to = letter->to;
    const bool is_receipt = !letter->bytes || letter->bytes->empty();
    wire.slot =
        is_receipt ? kReceiptSlot : static_cast<std::uint8_t>(letter->number % kLetterSlots);
  }
}

bool has_key_of(const km_wire_TeamParcel& wire, const TeamMessage& message) {
  km_wire_TeamParcel key{};
  set_key(message, key);
  return wire.origin == key.origin && wire.kind == key.kind && wire.to == key.to &&
         wire.slot == key.slot;
}

}  // namespace

Codec<TeamParcel>::Encoded Codec<TeamParcel>::encode(const TeamParcel& parcel) {
  Encoded encoded;
  encoded.content = km::encode(*parcel.message);
  encoded.wire.robot = parcel.from;
  set_key(*parcel.message, encoded.wire);
  borrow(encoded.wire.content, encoded.content);
  return encoded;
}

Decoded<TeamParcel> Codec<TeamParcel>::decode(const Wire& wire) {
  using Result = Decoded<TeamParcel>;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  const auto content = elements_of(wire.content, kMaxTeamMessageBytes);
  if (!content) return Result::refuse("the content is missing or too long");
  Decoded<TeamMessage> message = decode_team_message(*content);
  if (!message.value) return Result::refuse(message.refusal);
  if (!has_key_of(wire, *message.value)) return Result::refuse("its key is another message's");
  const TeamPeer origin = origin_of(*message.value);
  if (origin.robot == wire.robot && origin.boot != wire.header.boot)
    return Result::refuse("said by a former process of the robot that sends it");
  return Result::accept(
      {wire.robot, std::make_shared<const TeamMessage>(std::move(*message.value))});
}

}  // namespace km
