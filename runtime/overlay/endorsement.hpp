#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "modules/core/decoded.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/security/certificate.hpp"
#include "runtime/overlay/overlay_message.hpp"

namespace km {

/// Signing and checking functions of TeamSeal that the overlay of a team with keys uses.
struct OverlayKeys {
  std::function<Signature(OctetView statement)> endorse;
  std::function<std::optional<std::string>(const TeamPeer&)> credentials_of;
  std::function<Decoded<Certificate>(const RobotIdentity&, const std::string& credentials)>
      certified;
  std::function<const char*(const Certificate&)> why_lapsed;
};

/// Bytes of the origin's signature at the end of OverlayMessage::content in a team with keys.
inline constexpr std::size_t kEndorsementBytes = Signature().size();

/// Signature of this robot, the origin, over all fields of the message except `hops`. For a bag and
/// for a reply it covers the incarnation of the origin instead of the boot id, and not the
/// addressee. Thus bags and replies stay valid for the whole incarnation, and other robots that
/// request the same keyframe can use a reply.
[[nodiscard]] Signature endorsement_of(const OverlayMessage& message, const OverlayKeys& keys);

/// Appends the signature to the content.
void endorse(OverlayMessage& message, const OverlayKeys& keys);

/// True if the content ends with the signature of this message by the owner of `origin`.
[[nodiscard]] bool is_endorsed(const OverlayMessage& message, const PublicKey& origin);

/// Content of an introduction: the name of the origin and, in a team with keys, its credentials.
struct OverlayIntroduction {
  std::string name;
  std::string credentials = {};

  bool operator==(const OverlayIntroduction&) const = default;
};
[[nodiscard]] Octets to_octets(const OverlayIntroduction& introduction);
/// Nullopt if the content does not begin with a valid robot name or if the rest cannot be
/// credentials. Does not verify the credentials.
[[nodiscard]] std::optional<OverlayIntroduction> parse_introduction(OctetView content);

}  // namespace km
