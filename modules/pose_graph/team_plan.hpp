#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "modules/core/team_links.hpp"
#include "modules/pose_graph/session_graph.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// The newest edge set of robots a and b that both offer; nullopt if they share none.
[[nodiscard]] std::optional<EdgeSetOffer> agreed_edges(const TeamStatus& a, const TeamStatus& b);

/// The session that robot `self` is part of, given the latest status of every robot within reach
/// (its own included, keyed by robot) and the links between them: the connected component over
/// agreed edge sets. Every robot that knows the same comes to the same plan; the member with the
/// lowest id coordinates it.
///
/// The frame is the one that most members are in already (ties: most edges to other members, then
/// the lowest robot). Its robots come first, then always the robot with the most edges to those
/// before it: that is the order of alignment, best connected first.
///
/// The tree spans the members over links, those with the most agreed edges first (a maximum
/// spanning tree by Kruskal's algorithm; ties: lowest ids). Where links alone do not connect the
/// members, fewest hops over robots in between do. Its root is its centre, of two the lower one.
/// Throws std::invalid_argument if there is no status of `self`.
[[nodiscard]] SessionPlan plan_session(const std::map<RobotId, TeamStatus>& statuses,
                                       const TeamLinks& links, RobotId self);

/// Where `robot` is in the tree of `plan`. nullopt if it is not a member, or if the members'
/// parents make no tree.
[[nodiscard]] std::optional<TreePlace> place_in(const SessionPlan& plan, RobotId robot);

/// True if both plans optimise the same edges of the same processes, in whatever order, frame and
/// tree.
[[nodiscard]] bool same_graph(const SessionPlan& x, const SessionPlan& y);

/// True if a process of `session` is not in the plan `now`.
[[nodiscard]] bool has_lost_member(const SessionPlan& session, const SessionPlan& now);

/// What the session of `plan`, made of `statuses`, knows beside odometry: closures between its
/// robots and, since these are not told one by one, changes of those inside them.
[[nodiscard]] std::uint64_t closures_known(const SessionPlan& plan,
                                           const std::map<RobotId, TeamStatus>& statuses);

/// Lowest robot id of the members. Precondition: there is one.
[[nodiscard]] RobotId coordinator_of(const SessionPlan& plan);

}  // namespace km
