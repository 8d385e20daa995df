#pragma once

#include <map>
#include <optional>

#include "modules/pose_graph/pgo_messages.hpp"

namespace km {

/// The newest edge set of robots a and b that both offer; nullopt if they share none.
[[nodiscard]] std::optional<EdgeSetOffer> agreed_edges(const PgoStatus& a, const PgoStatus& b);

/// The session that robot `self` is part of, given the latest status of every robot present (its
/// own included, keyed by robot): the connected component over agreed edge sets. Every robot that
/// knows the same comes to the same plan; the member with the lowest id coordinates it.
///
/// The frame is the one that most members are in already (ties: most edges to other members, then
/// the lowest robot). Its robots come first, then always the robot with the most edges to those
/// before it: that is the order of alignment, best connected first, and of the sweep.
/// Throws std::invalid_argument if there is no status of `self`.
[[nodiscard]] SessionPlan plan_session(const std::map<RobotId, PgoStatus>& statuses, RobotId self);

/// What the session of `plan`, made of `statuses`, knows beside odometry: closures between its
/// robots and, since these are not told one by one, changes of those inside them.
[[nodiscard]] std::uint64_t closures_known(const SessionPlan& plan,
                                           const std::map<RobotId, PgoStatus>& statuses);

/// Lowest robot id of the members.
[[nodiscard]] RobotId coordinator_of(const SessionPlan& plan);

}  // namespace km
