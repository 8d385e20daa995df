#include "runtime/dds/sealed_envelope.hpp"

#include "modules/core/bytes.hpp"

namespace km {

SealedEnvelope::SealedEnvelope(const std::string& topic, const Guid& writer,
                               const km_wire_Envelope& head, std::optional<TeamPeer> addressee)
    : way_(topic + '/' + std::string(writer.begin(), writer.end())),
      sender_{head.robot, head.boot},
      number_(head.number),
      addressee_(addressee) {
  ByteWriter key;
  key.u64(head.key);
  key.u16(head.version);
  std::ranges::copy(key.release(), key_.begin());
}

SealContext SealedEnvelope::context() const {
  return {
      .topic = way_, .sender = sender_, .number = number_, .key = key_, .addressee = addressee_};
}

}  // namespace km
