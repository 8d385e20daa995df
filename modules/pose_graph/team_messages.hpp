#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "modules/core/closure_verdicts.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/precision.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/pose_graph/pgo_method.hpp"

namespace km {

/// No team has more robots.
inline constexpr std::size_t kMaxTeam = 1024;

/// The gauge that poses are expressed in: the process whose own frame it was. Robots with equal
/// frames need no alignment to each other.
using TeamFrame = TeamPeer;

/// A rigid transform in single precision, as it crosses the network.
struct SinglePose {
  Eigen::Quaternionf q = Eigen::Quaternionf::Identity();
  Eigen::Vector3f t = Eigen::Vector3f::Zero();  ///< [m]

  [[nodiscard]] static SinglePose of(const SE3& T) {
    return {Eigen::Quaterniond(T.linear()).cast<float>(), T.translation().cast<float>()};
  }
  /// What everyone makes of it, to the last bit.
  [[nodiscard]] SE3 pose() const {
    return make_pose(q.cast<double>().normalized().toRotationMatrix(), t.cast<double>());
  }
};

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

/// What one robot brings to distributed optimisation, and whom it hears; to all robots of the
/// team, also those that it does not hear itself. Sent when it changes and now and then.
struct TeamStatus {
  TeamPeer sender;
  std::uint32_t number = 0;  ///< Counts the sender's: the highest is the newest. A repeated one
                             ///< that says the same keeps it.
  std::vector<TeamPeer> hears = {};  ///< Directly, at present; ascending.
  TeamFrame frame;                   ///< Of its present solution.
  std::uint32_t frame_version = 0;   ///< Counts its changes of frame.
  std::uint32_t keyframes = 0;
  std::uint32_t revision = 0;  ///< Grows with its own keyframes and intra-robot closures.
  std::vector<EdgeSetOffer> offers = {};
  PgoMethod method = PgoMethod::kNewton;  ///< Its configuration's; only equal ones go together.
  /// Of its keyframe 0. Odometry's frame is upright, keyframe 0 need not be.
  SE3 T_odom_first = SE3::Identity();
  bool upright = false;  ///< Its keyframes have vertical priors in that frame.
  /// Hash of the newest statuses, sessions and poses that it holds. For those that hear it
  /// directly, which hand on what it lacks; no reason for a new number.
  std::uint64_t holds = 0;
};

/// A session optimises one frozen graph. Its coordinator numbers them.
struct SessionId {
  TeamPeer coordinator;
  std::uint32_t number = 0;
  auto operator<=>(const SessionId&) const = default;
};

struct SessionMember {
  TeamPeer peer;
  std::uint32_t revision = 0;          ///< Of its status when the session was planned.
  std::optional<RobotId> parent = {};  ///< In the tree of the session; nullopt: its root.
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
  TeamFrame frame;                     ///< Members in other frames are aligned to it first.
  std::vector<SessionMember> members;  ///< In order of alignment.
  std::vector<SessionPair> pairs;      ///< Ascending.
  [[nodiscard]] bool has_member(RobotId robot) const {
    return std::any_of(members.begin(), members.end(),
                       [&](const SessionMember& member) { return member.peer.robot == robot; });
  }
  bool operator==(const SessionPlan&) const = default;
};

/// A new session, its progress, its end: by its coordinator, to all members.
struct Session {
  SessionId id;
  std::uint32_t number = 0;  ///< Counts what its coordinator says: the highest is the newest.
  SessionPlan plan;
  PgoMethod method = PgoMethod::kNewton;
  bool upright = false;          ///< Members use their vertical priors: the solution has z up.
  std::uint32_t max_rounds = 0;  ///< 0: no limit.
  RobotId anchor = 0;            ///< The frame of its odometry is `world`.
  /// `world` in the session's frame: if the anchor is no longer a member, and at the end.
  std::optional<SE3> T_frame_world = {};
  std::uint32_t round = 0;  ///< Rounds that are complete.
  double cost = 0.0;        ///< Team cost after them.
  double gradient = 0.0;    ///< See SolverState.
  bool finished = false;    ///< Members stop.
};

/// Poses of one robot that its peers' edges end on, and keyframe 0, before (stage 0) and after
/// (stage 1) a session; to all robots of the team. Stage 2: after a session that it could not bring
/// to the end, which is over for all.
struct MemberPoses {
  TeamPeer sender;
  std::uint32_t number = 0;  ///< Counts the sender's: the highest is the newest.
  SessionId session = {};
  std::uint32_t stage = 0;
  TeamFrame frame = {};
  std::uint32_t frame_version = 0;  ///< As in TeamStatus: whichever message has more is newer.
  Precision step_precision = {};    ///< Mean weights of one step of its odometry.
  std::vector<KeyframeIndex> keyframes = {};  ///< Ascending, 0 first.
  std::vector<SinglePose> T_frame_kf = {};
  /// On closures to others. Stage 0: what sessions before have decided, as far as it knows; stage
  /// 1: what this session has made of those that it weighs.
  std::vector<WeighedClosure> verdicts = {};
  /// What it has sent in this session so far, to every reader, and passed on for others.
  std::uint64_t sent_bytes = 0;
};

/// A solver's letter to one member of a session, or, without bytes, only word of what was taken.
struct SessionLetter {
  TeamPeer sender;
  SessionId session = {};
  std::uint32_t number = 0;  ///< Counts the sender's letters to `to` in this session, from 0.
  RobotId to = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  std::uint32_t copy = 0;      ///< Counts what the sender has sent to `to`, repetitions included.
  std::uint32_t received = 0;  ///< So many letters of `to`, from the first on, have been taken.
};

using TeamMessage = std::variant<TeamStatus, Session, MemberPoses, SessionLetter>;

/// Who said it first.
[[nodiscard]] inline const TeamPeer& origin_of(const TeamMessage& message) {
  return std::visit(
      [](const auto& m) -> const TeamPeer& {
        if constexpr (requires { m.sender; })
          return m.sender;
        else
          return m.id.coordinator;
      },
      message);
}

/// The session it is about; nullopt for statuses.
[[nodiscard]] inline std::optional<SessionId> session_of(const TeamMessage& message) {
  return std::visit(
      [](const auto& m) -> std::optional<SessionId> {
        if constexpr (requires { m.session; })
          return m.session;
        else if constexpr (requires { m.id; })
          return m.id;
        else
          return std::nullopt;
      },
      message);
}

/// A message on its way across one link, to a robot that is heard directly. It may have been said
/// by another robot than the one that hands it on, and may be meant for yet another.
struct Parcel {
  RobotId next = 0;  ///< Robot at the other end of the link.
  std::shared_ptr<const TeamMessage> message;
};

}  // namespace km
