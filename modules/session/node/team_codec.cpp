#include "modules/session/node/team_codec.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "modules/session/team_message_bytes.hpp"

namespace km {
namespace {

// Number of reliable messages of one origin to one receiver that may be on one link at a time. A
// few would suffice, because solvers wait for answers. A repetition replaces its former copy.
constexpr std::uint32_t kReliableSlots = 64;
constexpr std::uint32_t kReceiptSlot = 64;  // acknowledgements without bytes: the newest counts

// Streams by TeamMessageKind.
constexpr OverlayStream kStreams[] = {OverlayStream::kTeamStatus, OverlayStream::kSession,
                                      OverlayStream::kMemberPoses, OverlayStream::kSolver};

}  // namespace

OverlayMessage overlay_message(const TeamMessage& message) {
  OverlayMessage result{.stream = kStreams[message.index()],
                        .origin = origin_of(message),
                        .content = encode(message)};
  if (const auto* reliable = std::get_if<ReliableMessage>(&message)) {
    const bool is_receipt = !reliable->bytes || reliable->bytes->empty();
    result.to = reliable->to;
    result.number = is_receipt ? kReceiptSlot : reliable->number % kReliableSlots;
  }
  return result;
}

Decoded<TeamMessage> team_message(const OverlayMessage& message) {
  const auto stream = std::ranges::find(kStreams, message.stream);
  return decode_team_message({.kind = static_cast<TeamMessageKind>(stream - std::begin(kStreams)),
                              .sender = message.origin,
                              .to = message.to,
                              .bytes = message.content});
}

void join_team(OverlayNode& overlay, In<TeamMessage> own, Out<TeamMessage> peers) {
  own.subscribe([&overlay](const auto& message) {
    OverlayMessage sent = overlay_message(*message);
    if (is_state(sent.stream))
      overlay.publish(sent.stream, std::move(sent.content));
    else
      overlay.call(sent.stream, sent.to, sent.number, std::move(sent.content));
  });
  const auto read = [peers](const OverlayMessage& received) -> const char* {
    Decoded<TeamMessage> message = team_message(received);
    if (message.value) peers.publish(std::move(*message.value));
    return message.refusal;
  };
  for (const OverlayStream stream : kStreams) overlay.read(stream, read);
}

}  // namespace km
