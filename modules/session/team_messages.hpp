#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/data/single_pose.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/session/pgo_method.hpp"

namespace km {

/// Identity of the set of edges between two robots. Both robots offer the sets that they hold, and
/// optimise one that both hold. `hash` covers the version, and the ids, translations and weights of
/// the closures.
struct EdgeSetId {
  std::uint32_t version = 0;
  std::uint64_t hash = 0;
  auto operator<=>(const EdgeSetId&) const = default;
};

struct EdgeSetOffer {
  RobotId peer = 0;
  std::uint32_t edges = 0;  ///< Number of closures, at least 1.
  EdgeSetId id;
  /// Number of rows (see find_rows()) of the closures that the sender keeps; of all of them if none
  /// has been weighed. One less, but at least 1, if a row of three closures is rejected.
  std::uint32_t places = 0;
  /// There is one such row, and a row with as many closures or more is rejected. Or there are more
  /// rows, and as many others or more agree with each other: count_rival_rows().
  bool contradicted = false;
  bool operator==(const EdgeSetOffer&) const = default;
};

/// The contribution of one robot to distributed optimisation. It goes to all robots of the team
/// when it changes.
struct TeamStatus {
  TeamPeer sender;
  std::uint32_t keyframes = 0;
  std::uint32_t revision = 0;  ///< Increases with its keyframes and the closures inside it.
  std::vector<EdgeSetOffer> offers = {};
  PgoMethod method = PgoMethod::kNewton;  ///< From its configuration; sessions need equal methods.
  /// Odometry pose of its keyframe 0. The frame of odometry is upright, keyframe 0 need not be.
  SE3 T_odom_first = SE3::Identity();
  bool upright = false;  ///< Its keyframes have vertical priors.
  /// Identity of the datum in which it is located; 0: it is not located. A datum is the frame of
  /// its fixes or of a finished map. Keyframe 0 of each robot in a datum is the same pose.
  std::uint64_t datum = 0;
};

/// Identity of a session. The coordinator numbers its sessions.
struct SessionId {
  TeamPeer coordinator;
  std::uint32_t number = 0;
  auto operator<=>(const SessionId&) const = default;
};

/// The frame of poses: the session that has begun it. A later session continues it only if it holds
/// poses of robots out of reach. Number 0: the odometry frame of the coordinator.
using TeamFrame = SessionId;

struct SessionMember {
  TeamPeer peer;
  std::uint32_t revision = 0;          ///< Revision in its status when the session was planned.
  std::optional<RobotId> parent = {};  ///< Parent in the tree of the session; nullopt: the root.
  std::uint64_t datum = 0;             ///< Datum in its status when the session was planned.
  bool operator==(const SessionMember&) const = default;
};

struct SessionPair {
  RobotId a = 0;  ///< a < b, both members.
  RobotId b = 0;
  EdgeSetId edges;
  bool operator==(const SessionPair&) const = default;
};

/// Members of a session, the edges that they optimise, and the order of alignment.
struct SessionPlan {
  TeamFrame frame;                     ///< That of the first member; the others are aligned to it.
  std::vector<SessionMember> members;  ///< In order of alignment.
  std::vector<SessionPair> pairs;      ///< Ascending.
  [[nodiscard]] bool has_member(RobotId robot) const {
    return std::any_of(members.begin(), members.end(),
                       [&](const SessionMember& member) { return member.peer.robot == robot; });
  }
  bool operator==(const SessionPlan&) const = default;
};

/// A new session, its progress or its end: from the coordinator to all members.
struct Session {
  SessionId id;
  SessionPlan plan;
  PgoMethod method = PgoMethod::kNewton;
  bool upright = false;          ///< Members use their vertical priors: the solution has z up.
  std::uint32_t max_rounds = 0;  ///< 0: no limit.
  RobotId anchor = 0;            ///< Robot whose odometry frame is `world`.
  /// `world` in the frame of the session: if the anchor is no longer a member, and at the end.
  std::optional<SE3> T_frame_world = {};
  std::uint32_t round = 0;  ///< Number of complete rounds.
  double cost = 0.0;        ///< Team cost after them.
  double gradient = 0.0;    ///< See SolverState.
  bool finished = false;    ///< Members stop.
};

/// How far a member is in a session.
enum class MemberStage : std::uint8_t {
  kEntered,  ///< It is in the frame of the session, and its poses are those of the start.
  kLooked,   ///< Its poses are a solution without the deferred closures, which are now weighed.
  kSolved,   ///< Its poses are the solution.
  kFailed,   ///< It could not complete the session, which is then over for all members.
};

/// Public poses of one robot, before and after a session; to all robots of the team.
struct MemberPoses {
  TeamPeer sender;
  SessionId session = {};
  MemberStage stage = MemberStage::kEntered;
  TeamFrame frame = {};
  Precision step_precision = {};  ///< Mean actual weights of one step of its odometry.
  /// Actual over claimed weights of its odometry, and of the closures inside it: see OdometryNoise.
  Precision odometry_precision = {}, closure_precision = {};  // at most 1
  std::vector<KeyframeIndex> keyframes = {};                  ///< Ascending, 0 first.
  /// First of `keyframes` in every later run of the robot, ascending: see LaterRuns.
  std::vector<KeyframeIndex> later_runs = {};
  std::vector<SinglePose> T_frame_kf = {};
  /// Verdicts of a solution on the closures to other robots that this robot weighs.
  std::vector<WeighedClosure> verdicts = {};
  /// Bytes that it has sent in this session so far, per receiver, and with forwarded messages.
  std::uint64_t sent_bytes = 0;
};

/// The newest public poses of each robot.
using PublicPoses = std::map<RobotId, MemberPoses>;

/// Reliable message of a solver to one member of a session, or, without bytes, only an
/// acknowledgement.
struct ReliableMessage {
  TeamPeer sender;
  SessionId session = {};
  std::uint32_t number = 0;  ///< Counts the messages of the sender to `to` in this session, from 0.
  RobotId to = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  std::uint32_t received = 0;  ///< Messages of `to` that have all been taken.
};

/// Messages between the robots of a team. The newest status, session and poses of each robot count,
/// and go to all robots; a reliable message goes to one.
using TeamMessage = std::variant<TeamStatus, Session, MemberPoses, ReliableMessage>;

/// The robot that sent the message first.
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

}  // namespace km
