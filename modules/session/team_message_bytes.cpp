#include "modules/session/team_message_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "modules/core/data/byte_archive.hpp"
#include "modules/core/data/team_links.hpp"
#include "modules/session/team_plan.hpp"

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

// With the rotation as a quaternion.
void describe_pose(auto& archive, As<SE3> auto& T) {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  if constexpr (!kReads<decltype(archive)>) q = T.linear(), t = T.translation();
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
  if constexpr (kReads<decltype(archive)>) archive.require(is_well_formed(plan));
}

void describe(auto& archive, As<Session> auto& m) {
  archive(m.id.number, m.plan);
  archive.choice(m.method, PgoMethod::kNewton);
  archive(m.upright, m.max_rounds, m.anchor);
  archive.optional(m.T_frame_world, [&](auto& T) { describe_pose(archive, T); });
  archive(m.round, m.cost, m.gradient, m.finished);
  if constexpr (kReads<decltype(archive)>)
    archive.require(!archive.failed() && coordinator_of(m.plan) == m.id.coordinator.robot);
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
  for (auto* precision : {&m.step_precision, &m.odometry_precision, &m.closure_precision}) {
    describe_weight(archive, precision->kappa);
    describe_weight(archive, precision->tau);
    archive.require(precision == &m.step_precision ||
                    (precision->kappa <= 1.0 && precision->tau <= 1.0));
  }
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
  archive.require(!m.keyframes.empty() && m.keyframes.front() == 0);
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
