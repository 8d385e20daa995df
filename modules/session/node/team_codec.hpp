#pragma once

#include "modules/core/decoded.hpp"
#include "modules/session/team_messages.hpp"
#include "runtime/overlay/overlay_message.hpp"
#include "runtime/overlay/overlay_node.hpp"
#include "runtime/topic.hpp"

namespace km {

/// The message of the overlay that carries a message of the pose graph. A state has no number yet.
/// The numbers of reliable messages only distinguish those that may be on their way at one time.
[[nodiscard]] OverlayMessage overlay_message(const TeamMessage& message);

/// Decodes a message of a stream of the pose graph.
[[nodiscard]] Decoded<TeamMessage> team_message(const OverlayMessage& message);

/// Connects the messages of the pose graph with the overlay. Call it before any node starts.
void join_team(OverlayNode& overlay, In<TeamMessage> own, Out<TeamMessage> peers);

}  // namespace km
