#include "modules/pose_graph/solver_message_codec.hpp"

#include <utility>

#include "runtime/dds/wire_sequence.hpp"

namespace km {
namespace {

using Result = Decoded<SolverMessage>;

// `inner` counts as written by whoever wrote the message around it.
template <typename Content, typename Inner>
Result with_content(SolverMessage message, const Inner& inner) {
  if (inner.robot != message.sender.robot) return Result::refuse("content of another robot");
  Inner written = inner;
  written.header.robot = inner.robot;
  auto decoded = Codec<Content>::decode(written);
  if (!decoded.value) return Result::refuse(decoded.refusal);
  message.content = std::move(*decoded.value);
  return Result::accept(std::move(message));
}

}  // namespace

Codec<SolverMessage>::Encoded Codec<SolverMessage>::encode(const SolverMessage& message) {
  Encoded encoded;
  Wire& wire = encoded.wire;
  wire.robot = message.sender.robot;
  wire.slot = static_cast<std::uint8_t>(slot_of(message.sequence));
  wire.coordinator = {.robot = message.session.coordinator.robot,
                      .boot = message.session.coordinator.boot};
  wire.session = message.session.number;
  wire.exchange = message.sequence;
  if (const auto* hello = std::get_if<NewtonHello>(&message.content)) {
    encoded.hello = Codec<NewtonHello>::encode(*hello);
    encoded.newton_hello = {encoded.hello.wire};
  } else if (const auto* share = std::get_if<NewtonShare>(&message.content)) {
    encoded.share = Codec<NewtonShare>::encode(*share);
    encoded.newton_share = {encoded.share.wire};
  }
  borrow(wire.newton_hello, encoded.newton_hello);
  borrow(wire.newton_share, encoded.newton_share);
  return encoded;
}

Decoded<SolverMessage> Codec<SolverMessage>::decode(const Wire& wire) {
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  if (wire.slot != slot_of(wire.exchange)) return Result::refuse("in the wrong slot");
  const auto hello = elements_of(wire.newton_hello, 1);
  const auto share = elements_of(wire.newton_share, 1);
  if (!hello || !share || hello->size() + share->size() > 1)
    return Result::refuse("more than one content");
  SolverMessage message{.sender = {wire.header.robot, wire.header.boot},
                        .session = {{wire.coordinator.robot, wire.coordinator.boot}, wire.session},
                        .sequence = wire.exchange,
                        .content = SolverGivesUp()};
  if (!hello->empty()) return with_content<NewtonHello>(std::move(message), hello->front());
  if (!share->empty()) return with_content<NewtonShare>(std::move(message), share->front());
  return Result::accept(std::move(message));
}

}  // namespace km
