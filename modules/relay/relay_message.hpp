#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "modules/core/robot_identity.hpp"

namespace km {

/// The enumerators are in the order of their numbers on the network.
enum class RelayKind : std::uint8_t {
  kIntroduction,  ///< Announces the origin; `content` is a RelayIntroduction.
  kBag,           ///< Bag of words for all robots; `number` is the keyframe's index.
  kClosure,       ///< Reliable message to `to`. An origin numbers its reliable messages of both
                  ///< kinds from 0.
  kInlierSet,     ///< Reliable message to `to`.
  kRequest,       ///< Request for keyframe `number` of `to`.
  kReply,         ///< Keyframe `number` of the origin, for `to`.
};

/// Message of one robot, the origin, that other robots forward.
struct RelayMessage {
  RelayKind kind = RelayKind::kIntroduction;
  TeamPeer origin;
  RobotId to = 0;             ///< Unused in kIntroduction and kBag.
  std::uint64_t to_boot = 0;  ///< In a reliable message: boot id of the only incarnation that it is
                              ///< for, or 0 for any.
  std::uint32_t number = 0;
  std::uint8_t hops = 0;  ///< In a request or a reply: number of robots that have forwarded it.
  /// Serialised message of the topic. It is empty in a reliable message that a newer one has
  /// replaced. In a team with keys the signature of the origin follows, except in an introduction
  /// (relay_endorsement.hpp).
  std::vector<std::uint8_t> content = {};

  bool operator==(const RelayMessage&) const = default;
};

using RelayMessagePtr = std::shared_ptr<const RelayMessage>;

[[nodiscard]] constexpr bool is_reliable(RelayKind kind) {
  return kind == RelayKind::kClosure || kind == RelayKind::kInlierSet;
}

/// Message on one hop, between a robot and a neighbour that receives it directly.
struct RelayPacket {
  RobotId neighbour = 0;  ///< Receiver of a sent message, sender of a received one.
  RelayMessagePtr message;
};

}  // namespace km
