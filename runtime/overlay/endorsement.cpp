#include "runtime/overlay/endorsement.hpp"

#include <algorithm>
#include <string_view>

#include "modules/security/credentials.hpp"
#include "modules/security/signing.hpp"

namespace km {
namespace {

constexpr std::size_t kMaxName = 64;
constexpr char kSeparator = ';';  // Character that no robot name contains.

Octets statement_of(const OverlayMessage& message, OctetView content) {
  const bool is_lasting =
      message.stream == OverlayStream::kBag || message.stream == OverlayStream::kReply;
  const std::uint64_t boot = message.origin.boot;
  ByteWriter writer = statement("kimera_multi message handed on 3");
  writer.u8(static_cast<std::uint8_t>(message.stream));
  writer.u16(message.origin.robot);
  writer.u64(is_lasting ? boot >> kResumeBits << kResumeBits : boot);
  writer.u16(is_lasting ? RobotId{0} : message.to);
  writer.u64(is_lasting ? 0 : message.to_boot);
  writer.u32(message.number);
  writer.bytes(content);
  return writer.release();
}

bool is_printable(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace

Signature endorsement_of(const OverlayMessage& message, const OverlayKeys& keys) {
  return keys.endorse(statement_of(message, message.content));
}

void endorse(OverlayMessage& message, const OverlayKeys& keys) {
  const Signature signature = endorsement_of(message, keys);
  message.is_signed = true;
  message.content.insert(message.content.end(), signature.begin(), signature.end());
}

bool is_endorsed(const OverlayMessage& message, const PublicKey& origin) {
  if (!message.is_signed || message.content.size() < kEndorsementBytes) return false;
  const OctetView content(message.content);
  Signature signature;
  std::ranges::copy(content.last(kEndorsementBytes), signature.begin());
  return verify(statement_of(message, content.first(content.size() - kEndorsementBytes)), signature,
                origin);
}

Octets to_octets(const OverlayIntroduction& introduction) {
  std::string text = introduction.name;
  if (!introduction.credentials.empty()) text += kSeparator + introduction.credentials;
  return {text.begin(), text.end()};
}

std::optional<OverlayIntroduction> parse_introduction(OctetView content) {
  if (content.size() > kMaxName + 1 + kCredentialsLength) return std::nullopt;
  const std::string text(content.begin(), content.end());
  const std::size_t name = std::min(text.find(kSeparator), text.size());
  if (name == 0 || name > kMaxName || !is_printable(text)) return std::nullopt;
  if (name == text.size()) return OverlayIntroduction{text};
  if (text.size() - name - 1 != kCredentialsLength) return std::nullopt;
  return OverlayIntroduction{text.substr(0, name), text.substr(name + 1)};
}

}  // namespace km
