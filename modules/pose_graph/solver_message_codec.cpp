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

// Writes `content` if it is of that kind, as the one element of `list`.
template <typename Content, typename Wire>
void write(const SolverContent& content, Codec<SolverMessage>::Encoded& encoded,
           std::vector<Wire>& list) {
  const auto* inner = std::get_if<Content>(&content);
  if (inner == nullptr) return;
  auto& kept =
      encoded.content.emplace<typename Codec<Content>::Encoded>(Codec<Content>::encode(*inner));
  list = {kept.wire};
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
  write<NewtonHello>(message.content, encoded, encoded.newton_hello);
  write<NewtonShare>(message.content, encoded, encoded.newton_share);
  write<GncHello>(message.content, encoded, encoded.gnc_hello);
  write<GncShare>(message.content, encoded, encoded.gnc_share);
  borrow(wire.newton_hello, encoded.newton_hello);
  borrow(wire.newton_share, encoded.newton_share);
  borrow(wire.gnc_hello, encoded.gnc_hello);
  borrow(wire.gnc_share, encoded.gnc_share);
  return encoded;
}

Decoded<SolverMessage> Codec<SolverMessage>::decode(const Wire& wire) {
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  if (wire.slot != slot_of(wire.exchange)) return Result::refuse("in the wrong slot");
  const auto hello = elements_of(wire.newton_hello, 1);
  const auto share = elements_of(wire.newton_share, 1);
  const auto gnc_hello = elements_of(wire.gnc_hello, 1);
  const auto gnc_share = elements_of(wire.gnc_share, 1);
  if (!hello || !share || !gnc_hello || !gnc_share ||
      hello->size() + share->size() + gnc_hello->size() + gnc_share->size() > 1)
    return Result::refuse("more than one content");
  SolverMessage message{.sender = {wire.header.robot, wire.header.boot},
                        .session = {{wire.coordinator.robot, wire.coordinator.boot}, wire.session},
                        .sequence = wire.exchange,
                        .content = SolverGivesUp()};
  if (!hello->empty()) return with_content<NewtonHello>(std::move(message), hello->front());
  if (!share->empty()) return with_content<NewtonShare>(std::move(message), share->front());
  if (!gnc_hello->empty()) return with_content<GncHello>(std::move(message), gnc_hello->front());
  if (!gnc_share->empty()) return with_content<GncShare>(std::move(message), gnc_share->front());
  return Result::accept(std::move(message));
}

}  // namespace km
