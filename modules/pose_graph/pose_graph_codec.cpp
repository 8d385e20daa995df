#include "modules/pose_graph/pose_graph_codec.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "runtime/dds/wire_pose.hpp"
#include "runtime/dds/wire_sequence.hpp"

namespace km {
namespace {

km_wire_PgoPeer to_wire(const PgoPeer& peer) {
  return {.robot = peer.robot, .boot = peer.boot};
}

PgoPeer from_wire(const km_wire_PgoPeer& wire) {
  return {wire.robot, wire.boot};
}

PgoPeer writer_of(const km_wire_Header& header) {
  return {header.robot, header.boot};
}

std::optional<PgoMethod> method_of(std::uint8_t wire) {
  const auto method = static_cast<PgoMethod>(wire);
  const bool known =
      method == PgoMethod::kRbcd || method == PgoMethod::kNewton || method == PgoMethod::kGnc;
  return known ? std::optional(method) : std::nullopt;
}

bool is_rank(std::uint32_t rank) {
  return 3 <= rank && rank <= kMaxRank;
}

}  // namespace

Codec<PgoStatus>::Encoded Codec<PgoStatus>::encode(const PgoStatus& status) {
  Encoded encoded;
  for (const EdgeSetOffer& offer : status.offers)
    encoded.offers.push_back({.peer = offer.peer,
                              .edges = offer.edges,
                              .set_version = offer.id.version,
                              .hash = offer.id.hash});
  encoded.wire.robot = status.sender.robot;
  encoded.wire.frame = to_wire(status.frame);
  encoded.wire.frame_version = status.frame_version;
  encoded.wire.keyframes = status.keyframes;
  encoded.wire.revision = status.revision;
  encoded.wire.method = static_cast<std::uint8_t>(status.method);
  encoded.wire.origin = to_wire(status.T_odom_first);
  encoded.wire.upright = status.upright;
  borrow(encoded.wire.offers, encoded.offers);
  return encoded;
}

Decoded<PgoStatus> Codec<PgoStatus>::decode(const Wire& wire) {
  using Result = Decoded<PgoStatus>;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  const auto offers = elements_of(wire.offers, 8 * kMaxTeam);
  if (!offers) return Result::refuse("offers are missing or too many");
  const auto method = method_of(wire.method);
  if (!method) return Result::refuse("unknown method");
  constexpr std::uint16_t kWithOrigin = 3;
  const auto T_odom_first =
      wire.header.version < kWithOrigin ? std::optional(SE3::Identity()) : from_wire(wire.origin);
  if (!T_odom_first) return Result::refuse("the origin is not a pose");
  PgoStatus status{.sender = writer_of(wire.header),
                   .frame = from_wire(wire.frame),
                   .frame_version = wire.frame_version,
                   .keyframes = wire.keyframes,
                   .revision = wire.revision,
                   .offers = {},
                   .method = *method,
                   .T_odom_first = *T_odom_first,
                   .upright = wire.upright};
  for (const km_wire_EdgeSetOffer& offer : *offers) {
    if (offer.edges == 0 || offer.peer == wire.robot)
      return Result::refuse("an offer without edges or to its own robot");
    status.offers.push_back({offer.peer, offer.edges, {offer.set_version, offer.hash}});
  }
  return Result::accept(std::move(status));
}

Codec<PgoSession>::Encoded Codec<PgoSession>::encode(const PgoSession& session) {
  Encoded encoded;
  for (const SessionMember& member : session.plan.members)
    encoded.members.push_back({.peer = to_wire(member.peer), .revision = member.revision});
  for (const SessionPair& pair : session.plan.pairs)
    encoded.pairs.push_back(
        {.a = pair.a, .b = pair.b, .set_version = pair.edges.version, .hash = pair.edges.hash});
  const auto anchor_pose = session.anchor_pose.reshaped();
  encoded.anchor_pose.assign(anchor_pose.begin(), anchor_pose.end());
  Wire& wire = encoded.wire;
  wire.robot = session.id.coordinator.robot;
  wire.session = session.id.number;
  wire.frame = to_wire(session.plan.frame);
  wire.rank = session.rank;
  wire.max_rounds = session.max_rounds;
  wire.anchor = session.anchor;
  wire.round = session.round;
  wire.cost = session.cost;
  wire.gradient_norm = session.gradient_norm;
  wire.finished = session.finished;
  wire.upright = session.upright;
  wire.method = static_cast<std::uint8_t>(session.method);
  borrow(wire.members, encoded.members);
  borrow(wire.pairs, encoded.pairs);
  borrow(wire.anchor_pose, encoded.anchor_pose);
  return encoded;
}

Decoded<PgoSession> Codec<PgoSession>::decode(const Wire& wire) {
  using Result = Decoded<PgoSession>;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  if (!is_rank(wire.rank)) return Result::refuse("rank is out of range");
  if (!std::isfinite(wire.cost) || !std::isfinite(wire.gradient_norm))
    return Result::refuse("cost or gradient is not finite");
  const auto members = elements_of(wire.members, kMaxTeam);
  const auto pairs = elements_of(wire.pairs, kMaxTeam * kMaxTeam / 2);
  const auto anchor_pose = elements_of(wire.anchor_pose, 4 * kMaxRank);
  if (!members || !pairs || !anchor_pose) return Result::refuse("a list is missing or too long");
  if (!anchor_pose->empty() && anchor_pose->size() != 4 * wire.rank)
    return Result::refuse("the anchor's pose does not have the session's rank");

  const auto method = method_of(wire.method);
  if (!method) return Result::refuse("unknown method");

  PgoSession session{.id = {writer_of(wire.header), wire.session}, .plan = {}};
  session.plan.frame = from_wire(wire.frame);
  for (const km_wire_SessionMember& member : *members)
    session.plan.members.push_back({from_wire(member.peer), member.revision});
  for (const km_wire_SessionPair& pair : *pairs)
    session.plan.pairs.push_back({pair.a, pair.b, {pair.set_version, pair.hash}});
  session.method = *method;
  session.upright = wire.upright;
  session.rank = wire.rank;
  session.max_rounds = wire.max_rounds;
  session.anchor = wire.anchor;
  if (!anchor_pose->empty())
    session.anchor_pose = Eigen::Map<const Eigen::MatrixXd>(anchor_pose->data(), wire.rank, 4);
  session.round = wire.round;
  session.cost = wire.cost;
  session.gradient_norm = wire.gradient_norm;
  session.finished = wire.finished;
  return Result::accept(std::move(session));
}

Codec<PublicPoses>::Encoded Codec<PublicPoses>::encode(const PublicPoses& poses) {
  Encoded encoded;
  encoded.keyframes = poses.keyframes;
  encoded.poses.reserve(static_cast<std::size_t>(poses.X.size()));
  for (const double x : poses.X.reshaped()) encoded.poses.push_back(static_cast<float>(x));
  Wire& wire = encoded.wire;
  wire.robot = poses.sender.robot;
  wire.coordinator = to_wire(poses.session.coordinator);
  wire.session = poses.session.number;
  wire.frame = to_wire(poses.frame);
  wire.frame_version = poses.frame_version;
  wire.round = poses.round;
  wire.cost = poses.cost;
  wire.squared_gradient = poses.squared_gradient;
  wire.rank = static_cast<std::uint32_t>(poses.X.rows());
  borrow(wire.keyframes, encoded.keyframes);
  borrow(wire.poses, encoded.poses);
  return encoded;
}

Decoded<PublicPoses> Codec<PublicPoses>::decode(const Wire& wire) {
  using Result = Decoded<PublicPoses>;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  if (!is_rank(wire.rank)) return Result::refuse("rank is out of range");
  const auto keyframes = elements_of(wire.keyframes, kMaxPublicPoses);
  const auto poses = elements_of(wire.poses, 4 * kMaxRank * kMaxPublicPoses);
  if (!keyframes || !poses) return Result::refuse("a list is missing or too long");
  if (poses->size() != 4 * wire.rank * keyframes->size())
    return Result::refuse("poses and keyframes differ in number");

  PublicPoses result{.sender = writer_of(wire.header),
                     .session = {from_wire(wire.coordinator), wire.session},
                     .frame = from_wire(wire.frame),
                     .frame_version = wire.frame_version,
                     .round = wire.round,
                     .cost = wire.cost,
                     .squared_gradient = wire.squared_gradient};
  result.keyframes.assign(keyframes->begin(), keyframes->end());
  result.X = Eigen::Map<const Eigen::MatrixXf>(poses->data(), wire.rank,
                                               4 * static_cast<Eigen::Index>(keyframes->size()))
                 .cast<double>();
  if (!result.X.allFinite() || !std::isfinite(wire.cost) || !std::isfinite(wire.squared_gradient))
    return Result::refuse("a number is not finite");
  return Result::accept(std::move(result));
}

Codec<CertificateShare>::Encoded Codec<CertificateShare>::encode(const CertificateShare& share) {
  Encoded encoded{.wire = {}, .rows = share.rows, .sums = share.sums};
  encoded.wire.robot = share.robot;
  encoded.wire.round = share.round;
  borrow(encoded.wire.rows, encoded.rows);
  borrow(encoded.wire.sums, encoded.sums);
  return encoded;
}

Decoded<CertificateShare> Codec<CertificateShare>::decode(const Wire& wire) {
  using Result = Decoded<CertificateShare>;
  constexpr std::size_t kMaxSums = 256;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  const auto rows = elements_of(wire.rows, 4 * kMaxPublicPoses);
  const auto sums = elements_of(wire.sums, kMaxSums);
  if (!rows || !sums) return Result::refuse("a list is missing or too long");
  if (rows->size() % 4 != 0) return Result::refuse("rows are not four to a pose");
  const auto finite = [](double value) { return std::isfinite(value); };
  if (!std::all_of(rows->begin(), rows->end(), finite) ||
      !std::all_of(sums->begin(), sums->end(), finite))
    return Result::refuse("a number is not finite");
  return Result::accept({.robot = wire.robot,
                         .round = wire.round,
                         .rows = {rows->begin(), rows->end()},
                         .sums = {sums->begin(), sums->end()}});
}

}  // namespace km
