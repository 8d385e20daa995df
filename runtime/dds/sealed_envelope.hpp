#pragma once

#include <envelope.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "modules/core/bytes.hpp"
#include "modules/security/team_seal.hpp"
#include "runtime/dds/entity.hpp"

namespace km {

/// The seal of an envelope's content also covers the topic, the participant that writes it, the
/// envelope's head, and the addressee. So a replayed envelope cannot be opened on
/// another topic or from another participant.
class SealedEnvelope {
 public:
  /// `head` is copied; its content is not looked at. `addressee`: none for a message to all.
  SealedEnvelope(const std::string& topic, const Guid& writer, const km_wire_Envelope& head,
                 std::optional<TeamPeer> addressee)
      : way_(topic + '/' + std::string(writer.begin(), writer.end())),
        sender_{head.robot, head.boot},
        number_(head.number),
        addressee_(addressee) {
    ByteWriter key;
    key.u64(head.key);
    key.u16(head.version);
    std::ranges::copy(key.release(), key_.begin());
  }

  /// The result refers to this object.
  [[nodiscard]] SealContext context() const {
    return {
        .topic = way_, .sender = sender_, .number = number_, .key = key_, .addressee = addressee_};
  }

 private:
  std::string way_;
  TeamPeer sender_;
  std::uint32_t number_;
  std::array<std::uint8_t, 16> key_{};
  std::optional<TeamPeer> addressee_;
};

}  // namespace km
