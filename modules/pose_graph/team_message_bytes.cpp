#include "modules/pose_graph/team_message_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "modules/core/bytes.hpp"
#include "modules/core/team_links.hpp"

namespace km {
namespace {

// Largest deviation of a quaternion from unit length; every user normalises it.
constexpr double kUnitTolerance = 1e-3;
// Largest distance of a robot from the origin of a frame [m].
constexpr double kMaxTranslation_m = 1e7;
// The largest weight of an edge [1/rad^2, 1/m^2], see pose_edge().
constexpr double kMaxPrecision = 1e13;
// Largest number of offered edge sets per peer.
constexpr std::size_t kMaxOffers = 8 * kMaxTeam;

// Smallest size of an element of each list [bytes]; it limits the memory that decoding reserves.
constexpr std::size_t kPeerBytes = 1 + 8;
constexpr std::size_t kOfferBytes = 1 + 1 + 1 + 8 + 1 + 1;
constexpr std::size_t kMemberBytes = kPeerBytes + 1 + 1 + 8;
constexpr std::size_t kPairBytes = 1 + 1 + 1 + 8;
constexpr std::size_t kPoseBytes = 1 + 7 * 4;
constexpr std::size_t kVerdictBytes = 4;

class MessageWriter {
 public:
  std::vector<std::uint8_t> message(const TeamMessage& message) {
    std::visit([this](const auto& m) { put(m); }, message);
    return out_.release();
  }

 private:
  void put(const TeamStatus& m) {
    out_.varint(m.keyframes);
    out_.varint(m.revision);
    out_.varint(m.offers.size());
    for (const EdgeSetOffer& offer : m.offers) {
      out_.varint(offer.peer);
      out_.varint(offer.edges);
      put(offer.id);
      out_.varint(offer.places);
      put(offer.contradicted);
    }
    put(m.method);
    put(m.T_odom_first);
    put(m.upright);
    out_.u64(m.datum);
  }

  void put(const Session& m) {
    out_.varint(m.id.number);
    put(m.plan);
    put(m.method);
    put(m.upright);
    out_.varint(m.max_rounds);
    out_.varint(m.anchor);
    put(m.T_frame_world.has_value());
    if (m.T_frame_world) put(*m.T_frame_world);
    out_.varint(m.round);
    out_.f64(m.cost);
    out_.f64(m.gradient);
    put(m.finished);
  }

  void put(const SessionPlan& plan) {
    put(plan.frame);
    out_.varint(plan.members.size());
    for (const SessionMember& member : plan.members) {
      put(member.peer);
      out_.varint(member.revision);
      out_.varint(member.parent ? std::uint64_t{*member.parent} + 1 : 0);
      out_.u64(member.datum);
    }
    out_.varint(plan.pairs.size());
    for (const SessionPair& pair : plan.pairs) {
      out_.varint(pair.a);
      out_.varint(pair.b);
      put(pair.edges);
    }
  }

  void put(const MemberPoses& m) {
    put(m.session);
    out_.varint(static_cast<std::uint32_t>(m.stage));
    put(m.frame);
    out_.f64(m.step_precision.kappa);
    out_.f64(m.step_precision.tau);
    out_.varint(m.keyframes.size());
    KeyframeIndex next = 0;
    for (const KeyframeIndex keyframe : m.keyframes) {
      out_.varint(keyframe - next);
      next = keyframe + 1;
    }
    for (const SinglePose& pose : m.T_frame_kf) {
      for (const float value : {pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()}) out_.f32(value);
      for (const float value : {pose.t.x(), pose.t.y(), pose.t.z()}) out_.f32(value);
    }
    out_.varint(m.verdicts.size());
    for (const WeighedClosure& verdict : m.verdicts) {
      out_.varint(2U * verdict.id.from.robot + (verdict.kept ? 1U : 0U));
      out_.varint(verdict.id.from.index);
      out_.varint(verdict.id.to.robot);
      out_.varint(verdict.id.to.index);
    }
    out_.varint(m.sent_bytes);
  }

  void put(const ReliableMessage& m) {
    put(m.session);
    out_.varint(m.number);
    out_.varint(m.received);
    if (m.bytes) out_.bytes(*m.bytes);
  }

  void put(const TeamPeer& peer) {
    out_.varint(peer.robot);
    out_.u64(peer.boot);
  }
  void put(const SessionId& id) {
    put(id.coordinator);
    out_.varint(id.number);
  }
  void put(const EdgeSetId& id) {
    out_.varint(id.version);
    out_.u64(id.hash);
  }
  void put(PgoMethod method) { out_.u8(static_cast<std::uint8_t>(method)); }
  void put(bool value) { out_.u8(value ? 1 : 0); }
  void put(const SE3& T) {
    const Eigen::Quaterniond q(T.linear());
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) out_.f64(value);
    for (const double value : T.translation()) out_.f64(value);
  }

  ByteWriter out_;
};

// Reads one message; the first error is the reason of the refusal.
class MessageReader {
 public:
  explicit MessageReader(const EncodedTeamMessage& message)
      : sender_(message.sender), to_(message.to), in_(message.bytes) {}

  Decoded<TeamMessage> message(TeamMessageKind kind) {
    switch (kind) {
      case TeamMessageKind::kStatus:
        return finished(status());
      case TeamMessageKind::kSession:
        return finished(session());
      case TeamMessageKind::kMemberPoses:
        return finished(member_poses());
      case TeamMessageKind::kReliable:
        break;
    }
    return finished(reliable());
  }

 private:
  Decoded<TeamMessage> finished(TeamMessage message) const {
    if (refusal_ != nullptr) return Decoded<TeamMessage>::refuse(refusal_);
    if (in_.failed()) return Decoded<TeamMessage>::refuse("cut short, or a number out of range");
    if (!in_.done()) return Decoded<TeamMessage>::refuse("longer than it should be");
    return Decoded<TeamMessage>::accept(std::move(message));
  }

  // After a failed check, all further reads return zero or empty values.
  void require(bool condition, const char* refusal) {
    if (condition || in_.failed()) return;
    refusal_ = refusal;
    in_.fail();
  }

  TeamStatus status() {
    TeamStatus m;
    m.sender = sender_;
    m.keyframes = u32();
    m.revision = u32();
    m.offers.resize(in_.count(kMaxOffers, kOfferBytes));
    for (std::size_t k = 0; k < m.offers.size(); ++k) {
      m.offers[k] = {robot(), u32(), edge_set(), u32(), flag()};
      require(k == 0 || m.offers[k - 1].peer <= m.offers[k].peer, "offers do not ascend");
      require(m.offers[k].peer != m.sender.robot, "an offer to its own robot");
      require(m.offers[k].edges > 0, "an offer without edges");
    }
    m.method = method();
    m.T_odom_first = pose();
    m.upright = flag();
    m.datum = in_.u64();
    return m;
  }

  Session session() {
    Session m;
    m.id = {sender_, u32()};
    m.plan = plan();
    m.method = method();
    m.upright = flag();
    m.max_rounds = u32();
    m.anchor = robot();
    if (flag()) m.T_frame_world = pose();
    m.round = u32();
    m.cost = finite();
    m.gradient = finite();
    m.finished = flag();
    return m;
  }

  SessionPlan plan() {
    SessionPlan p;
    p.frame = session_id();
    p.members.resize(in_.count(kMaxTeam, kMemberBytes));
    std::vector<RobotId> robots;
    for (SessionMember& member : p.members) {
      member.peer = peer();
      member.revision = u32();
      const std::uint64_t parent = in_.varint(std::uint64_t{kLastRobot} + 1);
      if (parent > 0) member.parent = static_cast<RobotId>(parent - 1);
      member.datum = in_.u64();
      robots.push_back(member.peer.robot);
    }
    std::sort(robots.begin(), robots.end());
    require(!robots.empty(), "a session without members");
    require(std::adjacent_find(robots.begin(), robots.end()) == robots.end(),
            "a member appears twice");
    const auto is_member = [&robots](RobotId robot) {
      return std::binary_search(robots.begin(), robots.end(), robot);
    };
    require(is_tree(p.members, robots), "the members' parents make no tree");

    p.pairs.resize(in_.count(kMaxTeam * (kMaxTeam - 1) / 2, kPairBytes));
    for (std::size_t k = 0; k < p.pairs.size(); ++k) {
      p.pairs[k] = {robot(), robot(), edge_set()};
      const SessionPair& pair = p.pairs[k];
      require(pair.a < pair.b && is_member(pair.a) && is_member(pair.b),
              "a pair of robots that are not members");
      require(k == 0 || std::pair(p.pairs[k - 1].a, p.pairs[k - 1].b) < std::pair(pair.a, pair.b),
              "pairs do not ascend");
    }
    return p;
  }

  // True if every parent is a member and none is its own ancestor. `robots` are the members,
  // ascending.
  static bool is_tree(const std::vector<SessionMember>& members,
                      const std::vector<RobotId>& robots) {
    constexpr auto kRoot = std::numeric_limits<std::size_t>::max();
    const auto place_of = [&robots](RobotId robot) -> std::size_t {
      const auto found = std::lower_bound(robots.begin(), robots.end(), robot);
      const auto place = static_cast<std::size_t>(found - robots.begin());
      return found != robots.end() && *found == robot ? place : robots.size();
    };
    std::vector<std::size_t> parent_of(robots.size(), kRoot);
    for (const SessionMember& member : members) {
      if (!member.parent) continue;
      const std::size_t parent = place_of(*member.parent);
      if (parent == robots.size()) return false;
      parent_of[place_of(member.peer.robot)] = parent;
    }
    // Walks up from each robot until a robot of an earlier walk; a robot of the same walk means a
    // cycle.
    std::vector<std::size_t> seen_by(robots.size(), kRoot);
    for (std::size_t start = 0; start < robots.size(); ++start) {
      std::size_t place = start;
      while (place != kRoot && seen_by[place] == kRoot) {
        seen_by[place] = start;
        place = parent_of[place];
      }
      if (place != kRoot && seen_by[place] == start) return false;
    }
    return true;
  }

  MemberPoses member_poses() {
    MemberPoses m;
    m.sender = sender_;
    m.session = session_id();
    const std::uint32_t stage = u32();
    require(stage <= static_cast<std::uint32_t>(MemberStage::kFailed), "an unknown stage");
    m.stage = static_cast<MemberStage>(stage);
    m.frame = session_id();
    m.step_precision = {weight(), weight()};
    m.keyframes.resize(in_.count(kMaxPublicPoses, kPoseBytes));
    std::uint64_t next = 0;
    for (KeyframeIndex& keyframe : m.keyframes) {
      const std::uint64_t index = next + in_.varint_as<std::uint32_t>();
      require(index <= std::numeric_limits<KeyframeIndex>::max(), "keyframes do not ascend");
      keyframe = static_cast<KeyframeIndex>(index);
      next = index + 1;
    }
    require(m.keyframes.empty() || m.keyframes.front() == 0, "keyframe 0 is not the first");
    m.T_frame_kf.resize(m.keyframes.size());
    for (SinglePose& pose : m.T_frame_kf) pose = single_pose();
    m.verdicts.resize(in_.count(kMaxPublicPoses, kVerdictBytes));
    for (WeighedClosure& verdict : m.verdicts) verdict = weighed_closure();
    m.sent_bytes = in_.varint();
    return m;
  }

  WeighedClosure weighed_closure() {
    const std::uint64_t robot_and_kept = in_.varint(2U * std::uint64_t{kLastRobot} + 1U);
    WeighedClosure verdict;
    verdict.kept = robot_and_kept % 2 == 1;
    verdict.id.from.robot = static_cast<RobotId>(robot_and_kept / 2);
    verdict.id.from.index = u32();
    verdict.id.to = {robot(), u32()};
    require(verdict.id.from < verdict.id.to, "not the id of a closure");
    return verdict;
  }

  ReliableMessage reliable() {
    ReliableMessage m;
    m.sender = sender_;
    m.session = session_id();
    m.number = u32();
    m.to = to_;
    m.received = u32();
    const auto bytes = in_.bytes(in_.left());
    m.bytes = std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end());
    return m;
  }

  RobotId robot() { return in_.varint_as<RobotId>(); }
  std::uint32_t u32() { return in_.varint_as<std::uint32_t>(); }
  // Braces guarantee that the arguments are evaluated from left to right.
  TeamPeer peer() { return TeamPeer{robot(), in_.u64()}; }
  SessionId session_id() { return SessionId{peer(), u32()}; }
  EdgeSetId edge_set() { return EdgeSetId{u32(), in_.u64()}; }

  PgoMethod method() {
    const auto method = static_cast<PgoMethod>(in_.u8());
    require(!to_string(method).empty(), "unknown method");
    return method;
  }
  bool flag() {
    const std::uint8_t value = in_.u8();
    require(value <= 1, "neither true nor false");
    return value == 1;
  }
  double finite() {
    const double value = in_.f64();
    require(std::isfinite(value), "a number is not finite");
    return value;
  }
  double weight() {
    const double value = in_.f64();
    require(value > 0.0 && value <= kMaxPrecision, "a weight out of range");
    return value;
  }
  SE3 pose() {
    const double x = in_.f64(), y = in_.f64(), z = in_.f64(), w = in_.f64();
    const Eigen::Quaterniond q(w, x, y, z);
    Eigen::Vector3d t;
    for (double& value : t) value = in_.f64();
    require(is_pose(q, t), "not a pose");
    return in_.failed() ? SE3::Identity() : make_pose(q.normalized().toRotationMatrix(), t);
  }
  SinglePose single_pose() {
    const float x = in_.f32(), y = in_.f32(), z = in_.f32(), w = in_.f32();
    SinglePose pose{{w, x, y, z}, {}};
    for (float& value : pose.t) value = in_.f32();
    require(is_pose(pose.q.cast<double>(), pose.t.cast<double>()), "not a pose");
    return pose;
  }
  // Written so that NaN fails.
  static bool is_pose(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
    return std::abs(q.norm() - 1.0) <= kUnitTolerance && t.allFinite() &&
           t.cwiseAbs().maxCoeff() <= kMaxTranslation_m;
  }

  static constexpr RobotId kLastRobot = std::numeric_limits<RobotId>::max();

  TeamPeer sender_;
  RobotId to_;
  ByteReader in_;
  const char* refusal_ = nullptr;
};

}  // namespace

std::vector<std::uint8_t> encode(const TeamMessage& message) {
  return MessageWriter().message(message);
}

Decoded<TeamMessage> decode_team_message(const EncodedTeamMessage& message) {
  if (message.bytes.size() > kMaxTeamMessageBytes) return Decoded<TeamMessage>::refuse("too long");
  return MessageReader(message).message(message.kind);
}

}  // namespace km
