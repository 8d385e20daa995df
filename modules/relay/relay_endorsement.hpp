#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "modules/core/decoded.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/relay/relay_message.hpp"
#include "modules/security/certificate.hpp"

namespace km {

/// What the relay of a team with keys asks of them; see TeamSeal for each.
struct RelayKeys {
  std::function<Signature(OctetView statement)> endorse;
  std::function<std::optional<std::string>(const TeamPeer&)> credentials_of;
  std::function<Decoded<Certificate>(const RobotIdentity&, const std::string& credentials)>
      certified;
  std::function<const char*(const Certificate&)> why_lapsed;
};

/// Octets of the origin's signature behind RelayMessage::content, where the team has keys.
inline constexpr std::size_t kEndorsementBytes = Signature().size();

/// The signature of this robot, the origin, over all of the message but `hops`. Of a bag and of an
/// answer it covers the origin's life and not its process, and not whom it is for: what a robot has
/// told lasts as long as its life, and an answer may go to others that ask for the same.
[[nodiscard]] Signature endorsement_of(const RelayMessage& message, const RelayKeys& keys);

/// Puts that behind the content.
void endorse(RelayMessage& message, const RelayKeys& keys);

/// True if the content ends with the signature that the owner of `origin` has made for this
/// message.
[[nodiscard]] bool is_endorsed(const RelayMessage& message, const PublicKey& origin);

/// The content of an introduction: a name and, where the team has keys, what the origin shows.
struct RelayIntroduction {
  std::string name;
  std::string credentials = {};

  bool operator==(const RelayIntroduction&) const = default;
};
[[nodiscard]] Octets to_octets(const RelayIntroduction& introduction);
/// Nothing if that is not a robot's name, or not like credentials, whose contents are not looked
/// at.
[[nodiscard]] std::optional<RelayIntroduction> parse_introduction(OctetView content);

}  // namespace km
