#include "modules/session/team_message_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "modules/core/byte_archive.hpp"
#include "modules/core/team_links.hpp"

namespace km {
namespace {

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

// True if every parent is a member and none is its own ancestor. `robots` are the members,
// ascending.
bool is_tree(const std::vector<SessionMember>& members, const std::vector<RobotId>& robots) {
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

// With the rotation as a quaternion.
void describe_pose(auto& archive, As<SE3> auto& T) {
  Eigen::Quaterniond q(T.linear());
  Eigen::Vector3d t = T.translation();
  archive(q.coeffs(), t);
  const bool is_pose =
      std::abs(q.norm() - 1.0) <= kUnitTolerance && t.cwiseAbs().maxCoeff() <= kMaxTranslation_m;
  archive.require(is_pose);
  if constexpr (kReads<decltype(archive)>)
    T = is_pose ? make_pose(q.normalized().toRotationMatrix(), t) : SE3::Identity();
}

void describe_weight(auto& archive, auto& weight) {
  archive(weight);
  archive.require(weight > 0.0 && weight <= kMaxPrecision);
}

}  // namespace

// Archives find these functions by argument-dependent lookup, which sees no unnamed namespace.

void describe(auto& archive, As<TeamPeer> auto& peer) {
  archive(peer.robot);
  archive.fixed(peer.boot);
}

void describe(auto& archive, As<SessionId> auto& id) {
  archive(id.coordinator, id.number);
}

void describe(auto& archive, As<EdgeSetId> auto& id) {
  archive(id.version);
  archive.fixed(id.hash);
}

void describe(auto& archive, As<EdgeSetOffer> auto& offer) {
  archive(offer.peer, offer.edges, offer.id, offer.places, offer.contradicted);
  archive.require(offer.edges > 0);
}

void describe(auto& archive, As<TeamStatus> auto& m) {
  archive(m.keyframes, m.revision);
  archive.list(m.offers, kMaxOffers, kOfferBytes);
  for (const EdgeSetOffer& offer : m.offers) archive.require(offer.peer != m.sender.robot);
  archive.require(std::ranges::is_sorted(m.offers, {}, &EdgeSetOffer::peer));
  archive.choice(m.method, PgoMethod::kNewton);
  describe_pose(archive, m.T_odom_first);
  archive(m.upright);
  archive.fixed(m.datum);
}

void describe(auto& archive, As<SessionMember> auto& member) {
  archive(member.peer, member.revision);
  archive.optional(member.parent, [&](auto& parent) { archive(parent); });
  archive.fixed(member.datum);
}

void describe(auto& archive, As<SessionPair> auto& pair) {
  archive(pair.a, pair.b, pair.edges);
}

void describe(auto& archive, As<SessionPlan> auto& plan) {
  archive(plan.frame);
  archive.list(plan.members, kMaxTeam, kMemberBytes);
  archive.list(plan.pairs, kMaxTeam * (kMaxTeam - 1) / 2, kPairBytes);
  std::vector<RobotId> robots;
  for (const SessionMember& member : plan.members) robots.push_back(member.peer.robot);
  std::ranges::sort(robots);
  archive.require(!robots.empty() && std::ranges::adjacent_find(robots) == robots.end() &&
                  is_tree(plan.members, robots));
  const auto ends = [](const SessionPair& pair) { return std::pair(pair.a, pair.b); };
  archive.require(std::ranges::adjacent_find(plan.pairs, std::ranges::greater_equal(), ends) ==
                  plan.pairs.end());
  for (const SessionPair& pair : plan.pairs)
    archive.require(pair.a < pair.b && std::ranges::binary_search(robots, pair.a) &&
                    std::ranges::binary_search(robots, pair.b));
}

void describe(auto& archive, As<Session> auto& m) {
  archive(m.id.number, m.plan);
  archive.choice(m.method, PgoMethod::kNewton);
  archive(m.upright, m.max_rounds, m.anchor);
  archive.optional(m.T_frame_world, [&](auto& T) { describe_pose(archive, T); });
  archive(m.round, m.cost, m.gradient, m.finished);
}

void describe(auto& archive, As<WeighedClosure> auto& verdict) {
  std::uint32_t robot_and_kept = 2U * verdict.id.from.robot + (verdict.kept ? 1U : 0U);
  archive(robot_and_kept, verdict.id.from.index, verdict.id.to);
  archive.require(robot_and_kept / 2U <= std::numeric_limits<RobotId>::max());
  if constexpr (kReads<decltype(archive)>) {
    verdict.kept = robot_and_kept % 2U == 1U;
    verdict.id.from.robot = static_cast<RobotId>(robot_and_kept / 2U);
  }
  archive.require(verdict.id.from < verdict.id.to);
}

void describe(auto& archive, As<MemberPoses> auto& m) {
  archive(m.session);
  archive.choice(m.stage, MemberStage::kFailed);
  archive(m.frame);
  describe_weight(archive, m.step_precision.kappa);
  describe_weight(archive, m.step_precision.tau);
  for (const auto& [keyframes, bytes] :
       {std::pair(&m.keyframes, kPoseBytes), std::pair(&m.later_runs, std::size_t{1})}) {
    std::uint64_t next = 0;  // keyframes are sent as differences
    archive.list(*keyframes, kMaxPublicPoses, bytes, [&](auto& keyframe) {
      auto skipped = static_cast<std::uint32_t>(keyframe - next);
      archive(skipped);
      archive.require(next + skipped <= std::numeric_limits<KeyframeIndex>::max());
      if constexpr (kReads<decltype(archive)>)
        keyframe = static_cast<KeyframeIndex>(next + skipped);
      next = std::uint64_t{keyframe} + 1;
    });
  }
  archive.require(m.keyframes.empty() || m.keyframes.front() == 0);
  if constexpr (kReads<decltype(archive)>) m.T_frame_kf.resize(m.keyframes.size());
  for (auto& pose : m.T_frame_kf) archive(pose);
  archive.list(m.verdicts, kMaxPublicPoses, kVerdictBytes);
  archive(m.sent_bytes);
}

void describe(auto& archive, As<ReliableMessage> auto& m) {
  archive(m.session, m.number, m.received);
  if constexpr (kReads<decltype(archive)>) {
    const auto bytes = archive.rest();
    m.bytes = std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end());
  } else if (m.bytes) {
    archive.rest(*m.bytes);
  }
}

namespace {

Decoded<TeamMessage> decoded(std::span<const std::uint8_t> bytes, auto message) {
  ArchiveReader archive(bytes);
  describe(archive, message);
  if (archive.done()) return Decoded<TeamMessage>::accept(std::move(message));
  return Decoded<TeamMessage>::refuse("cut short, or a value out of range");
}

}  // namespace

std::vector<std::uint8_t> encode(const TeamMessage& message) {
  ArchiveWriter archive;
  std::visit([&](const auto& m) { describe(archive, m); }, message);
  return archive.release();
}

Decoded<TeamMessage> decode_team_message(const EncodedTeamMessage& message) {
  if (message.bytes.size() > kMaxTeamMessageBytes) return Decoded<TeamMessage>::refuse("too long");
  switch (message.kind) {
    case TeamMessageKind::kStatus:
      return decoded(message.bytes, TeamStatus{.sender = message.sender});
    case TeamMessageKind::kSession:
      return decoded(message.bytes, Session{.id = {.coordinator = message.sender}, .plan = {}});
    case TeamMessageKind::kMemberPoses:
      return decoded(message.bytes, MemberPoses{.sender = message.sender});
    case TeamMessageKind::kReliable:
      break;
  }
  return decoded(message.bytes,
                 ReliableMessage{.sender = message.sender, .to = message.to, .bytes = nullptr});
}

}  // namespace km
