#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "modules/core/data/team_links.hpp"
#include "modules/robust/session_graph.hpp"
#include "modules/session/team_messages.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// The newest edge set that robots a and b both offer; nullopt if there is none.
[[nodiscard]] std::optional<EdgeSetOffer> agreed_edges(const TeamStatus& a, const TeamStatus& b);

/// Plan of the session of robot `self` without its frame and its tree, from the latest status of
/// every robot within reach (including its own, keyed by robot). The members are the connected
/// component over agreed edge sets. Robots with equal knowledge compute equal plans; the member
/// with the lowest id coordinates the session.
///
/// The order of alignment begins with the robot with the most edges. The next robot is always the
/// one with the most edges to the robots before it.
///
/// Throws std::invalid_argument if there is no status of `self`.
[[nodiscard]] SessionPlan plan_session(const std::map<RobotId, TeamStatus>& statuses, RobotId self);

/// Sets the parents in `plan`, made from `statuses`: the tree of choose_tree(), weighted by agreed
/// edges, with the root centre_of() it. If there are two, the one with more closures to others is
/// the root, or with as many the one with more keyframes. Ids decide if these are equal, too.
void plan_tree(SessionPlan& plan, const std::map<RobotId, TeamStatus>& statuses,
               const TeamLinks& links);

/// Edges that end on keyframe 0 of `robot`, from keyframe 0 of the lowest member of each datum to
/// keyframe 0 of each other member of it, ascending by id. Each measures the identity, because both
/// keyframes are the origin of the datum. The standard deviations are 1 mm and 0.01 mrad, which is
/// 1 cm at 1 km from the origin: little compared to the errors of fixes.
[[nodiscard]] std::vector<PoseEdge> datum_ties(const SessionPlan& plan, RobotId robot);

/// The place of `robot` in the tree of `plan`. nullopt if it is not a member, or if the parents of
/// the members do not form a tree.
[[nodiscard]] std::optional<TreePlace> place_in(const SessionPlan& plan, RobotId robot);

/// True if a plan that was received is in order: the parents of the members form a tree, and the
/// pairs are ascending and between members.
[[nodiscard]] bool is_well_formed(const SessionPlan& plan);

/// True if both plans optimise the same edges of the same processes, in the same datums, regardless
/// of order, frame and tree.
[[nodiscard]] bool same_graph(const SessionPlan& x, const SessionPlan& y);

/// True if `now` has nothing that `session` lacks: the same edges of the same processes, except for
/// those of robots out of reach.
[[nodiscard]] bool has_nothing_new(const SessionPlan& session, const SessionPlan& now);

/// True if a process of `session` is not in the plan `now`.
[[nodiscard]] bool has_lost_member(const SessionPlan& session, const SessionPlan& now);

/// Number of closures between the robots of a session of `plan`, made from `statuses`.
[[nodiscard]] std::uint64_t closures_between(const SessionPlan& plan,
                                             const std::map<RobotId, TeamStatus>& statuses);

/// Lowest robot id of the members. Precondition: there is a member.
[[nodiscard]] RobotId coordinator_of(const SessionPlan& plan);

}  // namespace km
