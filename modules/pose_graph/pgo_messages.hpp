#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <tuple>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/pgo_method.hpp"
#include "modules/pose_graph/stiefel.hpp"

namespace km {

/// A process of a robot: a restarted robot keeps its id and gets another boot.
struct PgoPeer {
  RobotId robot = 0;
  std::uint64_t boot = 0;
  auto operator<=>(const PgoPeer&) const = default;
};

/// The gauge that lifted poses are expressed in: the process whose own frame it was. Robots with
/// equal frames need no alignment to each other.
using PgoFrame = PgoPeer;

/// Identity of the edges between two robots: both ends offer what they hold, and optimise what
/// both hold. `hash` covers the version and the closures' ids.
struct EdgeSetId {
  std::uint32_t version = 0;
  std::uint64_t hash = 0;
  auto operator<=>(const EdgeSetId&) const = default;
};

struct EdgeSetOffer {
  RobotId peer = 0;
  std::uint32_t edges = 0;  ///< Number of closures, at least 1.
  EdgeSetId id;
  bool operator==(const EdgeSetOffer&) const = default;
};

/// What one robot brings to distributed optimisation; sent when it changes and now and then.
struct PgoStatus {
  PgoPeer sender;
  PgoFrame frame;                   ///< Of its present solution.
  std::uint32_t frame_version = 0;  ///< Counts its changes of frame.
  std::uint32_t keyframes = 0;
  std::uint32_t revision = 0;  ///< Grows with its own keyframes and intra-robot closures.
  std::vector<EdgeSetOffer> offers = {};
  PgoMethod method = PgoMethod::kRbcd;  ///< Its configuration's; only equal ones go together.
  /// Of its keyframe 0. Odometry's frame is upright, keyframe 0 need not be.
  SE3 T_odom_first = SE3::Identity();
  bool upright = false;  ///< Its keyframes have vertical priors in that frame.
  friend bool operator==(const PgoStatus& a, const PgoStatus& b) {
    const auto rest = [](const PgoStatus& s) {
      return std::tie(s.sender, s.frame, s.frame_version, s.keyframes, s.revision, s.offers,
                      s.method, s.upright);
    };
    return rest(a) == rest(b) && a.T_odom_first.matrix() == b.T_odom_first.matrix();
  }
};

/// A session optimises one frozen graph. Its coordinator numbers them.
struct PgoSessionId {
  PgoPeer coordinator;
  std::uint32_t number = 0;
  auto operator<=>(const PgoSessionId&) const = default;
};

struct SessionMember {
  PgoPeer peer;
  std::uint32_t revision = 0;  ///< Of its status when the session was planned.
  bool operator==(const SessionMember&) const = default;
};

struct SessionPair {
  RobotId a = 0;  ///< a < b, both members.
  RobotId b = 0;
  EdgeSetId edges;
  bool operator==(const SessionPair&) const = default;
};

/// Who optimises which edges, and in which order.
struct SessionPlan {
  PgoFrame frame;                      ///< Members in other frames are aligned to it first.
  std::vector<SessionMember> members;  ///< In order of alignment and of the sweep.
  std::vector<SessionPair> pairs;      ///< Ascending.
  [[nodiscard]] bool has_member(RobotId robot) const {
    return std::any_of(members.begin(), members.end(),
                       [&](const SessionMember& member) { return member.peer.robot == robot; });
  }
  bool operator==(const SessionPlan&) const = default;
};

/// Sent by the coordinator: a new session, its progress, its end.
struct PgoSession {
  PgoSessionId id;
  SessionPlan plan;
  PgoMethod method = PgoMethod::kRbcd;
  bool upright = false;  ///< Members use their vertical priors: the solution has z up.
  std::uint32_t rank = 0;
  std::uint32_t max_rounds = 0;  ///< 0: no limit.
  RobotId anchor = 0;            ///< The frame of its odometry is `world`.
  /// Of `world`, r x 4, if the anchor is no longer a member, and at the end of exchanges; else
  /// empty.
  LiftedPoses anchor_pose = {};
  std::uint32_t round = 0;     ///< Last round that all members have finished.
  double cost = 0.0;           ///< Team cost after it.
  double gradient_norm = 0.0;  ///< See OptimizerProgress.
  bool finished = false;       ///< Members stop.
};

/// Poses of one robot that its peers' edges end on, and keyframe 0, after one of its updates, or,
/// where the session is solved by exchanges, before (round 0) and after them (round 1).
struct PublicPoses {
  PgoPeer sender;
  PgoSessionId session = {};
  PgoFrame frame = {};
  std::uint32_t frame_version = 0;  ///< As in PgoStatus: whichever message has more is newer.
  std::uint32_t round = 0;          ///< 0: before the first update.
  double cost = 0.0;                ///< Share of rbcd: own edges, and those to earlier members.
  double squared_gradient = 0.0;    ///< Of the block before this update of rbcd.
  std::vector<std::uint32_t> keyframes = {};  ///< Ascending, 0 first.
  LiftedPoses X = {};                         ///< r x 4 per keyframe, single precision.
};

/// One exchange of a distributed verification, see CertificateAgent.
struct CertificateShare {
  RobotId robot = 0;
  std::uint32_t round = 0;
  std::vector<double> rows = {};  ///< Of a vector, 4 per public pose; or empty.
  std::vector<double> sums = {};  ///< To be added over the team; or empty.
  bool operator==(const CertificateShare&) const = default;
};

}  // namespace km
