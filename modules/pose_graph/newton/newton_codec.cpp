#include "modules/pose_graph/newton/newton_codec.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "modules/pose_graph/newton/wire_blocks.hpp"
#include "runtime/dds/wire_pose.hpp"
#include "runtime/dds/wire_sequence.hpp"

namespace km {
namespace {

using Eigen::Index;

constexpr Index kMaxBlock = 6;

std::vector<double> all_of(const Eigen::MatrixXd& M) {
  return {M.data(), M.data() + M.size()};
}

Eigen::MatrixXd matrix_of(std::span<const double> values, Index rows) {
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), rows,
                                           static_cast<Index>(values.size()) / rows);
}

km_wire_SinglePose to_wire(const SinglePose& T) {
  return {.q = {T.q.x(), T.q.y(), T.q.z(), T.q.w()}, .t = {T.t.x(), T.t.y(), T.t.z()}};
}

std::optional<SinglePose> from_wire(const km_wire_SinglePose& wire) {
  constexpr float kUnit = 1e-3F;
  const SinglePose T{Eigen::Quaternionf(wire.q[3], wire.q[0], wire.q[1], wire.q[2]),
                     Eigen::Vector3f(wire.t[0], wire.t[1], wire.t[2])};
  // Written so that NaN fails.
  const bool usable = std::abs(T.q.norm() - 1.0F) <= kUnit && T.t.allFinite();
  return usable ? std::optional(T) : std::nullopt;
}

bool is_precision(float value) {
  return value >= 0.0F && std::isfinite(value);
}

// The edges of a share with so many couplings; nullopt if one makes no sense.
std::optional<std::vector<KeptEdge>> edges_of(std::span<const km_wire_KeptEdge> edges,
                                              std::span<const km_wire_SinglePose> measured,
                                              std::size_t couplings) {
  std::vector<KeptEdge> result;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const km_wire_KeptEdge& wire = edges[k];
    const auto present = from_wire(wire.T_i_j);
    const auto was = measured.empty() ? present : from_wire(measured[k]);
    if (!present || !was || wire.pair / 2 >= couplings || !is_precision(wire.kappa) ||
        !is_precision(wire.tau))
      return std::nullopt;
    result.push_back({static_cast<int>(wire.pair / 2), wire.pair % 2 == 1, wire.kappa, wire.tau,
                      *present, *was});
  }
  return result;
}

struct SecondDerivatives {
  BlockMatrix schur;
  Curvature curvature = Curvature::kGaussNewton;
  std::vector<KeptEdge> edges;
};

std::size_t count(const std::vector<bool>& there, std::size_t from, std::size_t to) {
  const auto at = [&](std::size_t k) { return there.begin() + static_cast<std::ptrdiff_t>(k); };
  return static_cast<std::size_t>(std::count(at(from), at(to), true));
}

// What a share with so many kept poses says of them; empty if nothing. Precondition: the block size
// is in range.
Decoded<SecondDerivatives> second_derivatives_of(const km_wire_NewtonShare& wire,
                                                 std::size_t poses) {
  using Result = Decoded<SecondDerivatives>;
  const Index B = wire.block;
  const auto block = static_cast<std::size_t>(B * B);
  const auto triangle = static_cast<std::size_t>(B * (B + 1) / 2);
  const auto diagonal = elements_of(wire.diagonal, kMaxKeptPoses * triangle);
  const auto coupling = elements_of(wire.coupling, kMaxCouplings * block);
  const auto present = elements_of(wire.present, (kMaxKeptPoses + kMaxCouplings) / 8);
  const auto edges = elements_of(wire.edges, kMaxCouplings);
  const auto measured = elements_of(wire.measured, kMaxCouplings);
  if (!diagonal || !coupling || !present || !edges || !measured)
    return Result::refuse("a list is missing or too long");
  // Every coupling has a block or an edge: nobody makes room for more than he has sent.
  if (wire.couplings > coupling->size() / block + edges->size())
    return Result::refuse("couplings of which nothing is said");
  const std::size_t blocks = present->empty() ? 0 : poses + wire.couplings;
  if (present->size() != (blocks + 7) / 8 || (blocks == 0 && wire.couplings > 0))
    return Result::refuse("right-hand side and Schur complement differ in size");
  const std::vector<bool> there = unpacked(*present, blocks);
  const std::size_t of_poses = std::min(poses, blocks);
  if (count(there, 0, of_poses) * triangle != diagonal->size() ||
      count(there, of_poses, blocks) * block != coupling->size())
    return Result::refuse("other blocks than are said to be there");
  if (!measured->empty() && measured->size() != edges->size())
    return Result::refuse("edges and what was measured differ in number");
  if (!all_finite(*diagonal) || !all_finite(*coupling))
    return Result::refuse("a number is not finite");
  auto kept_edges = edges_of(*edges, *measured, wire.couplings);
  if (!kept_edges) return Result::refuse("an edge between kept poses makes no sense");

  SecondDerivatives second;
  if (blocks > 0)
    second.schur = {scattered(from_lower_triangles(*diagonal, B), poses, there, 0),
                    scattered(matrix_of(*coupling, B), wire.couplings, there, poses)};
  second.curvature = measured->empty() ? Curvature::kGaussNewton : Curvature::kFull;
  second.edges = *std::move(kept_edges);
  return Result::accept(std::move(second));
}

}  // namespace

Codec<NewtonHello>::Encoded Codec<NewtonHello>::encode(const NewtonHello& hello) {
  Encoded encoded;
  for (const PublicLink& link : hello.links)
    encoded.links.push_back({.own = link.a.index, .other = to_wire(link.b)});
  encoded.poses = hello.poses;
  for (const SE3& T : hello.T_world_pose) encoded.T_world_pose.push_back(to_wire(T));
  encoded.wire.robot = hello.robot;
  borrow(encoded.wire.links, encoded.links);
  borrow(encoded.wire.poses, encoded.poses);
  borrow(encoded.wire.T_world_pose, encoded.T_world_pose);
  return encoded;
}

Decoded<NewtonHello> Codec<NewtonHello>::decode(const Wire& wire) {
  using Result = Decoded<NewtonHello>;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  const auto links = elements_of(wire.links, kMaxPublicLinks);
  const auto poses = elements_of(wire.poses, kMaxPublicLinks);
  const auto T_world_pose = elements_of(wire.T_world_pose, kMaxPublicLinks);
  if (!links || !poses || !T_world_pose) return Result::refuse("a list is missing or too long");
  if (!T_world_pose->empty() && T_world_pose->size() != poses->size())
    return Result::refuse("poses and their values differ in number");
  if (!std::is_sorted(poses->begin(), poses->end())) return Result::refuse("poses out of order");
  NewtonHello hello{.robot = wire.robot};
  for (const km_wire_PublicLink& link : *links) {
    if (link.other.robot <= wire.robot) return Result::refuse("a link to a lower robot");
    hello.links.push_back({{wire.robot, link.own}, from_wire(link.other)});
  }
  hello.poses.assign(poses->begin(), poses->end());
  for (const km_wire_Pose& pose : *T_world_pose) {
    const std::optional<SE3> T = from_wire(pose);
    if (!T) return Result::refuse("a pose is not a rigid transform");
    hello.T_world_pose.push_back(*T);
  }
  return Result::accept(std::move(hello));
}

Codec<NewtonShare>::Encoded Codec<NewtonShare>::encode(const NewtonShare& share) {
  Encoded encoded;
  encoded.reduced = all_of(share.reduced);
  const std::vector<bool> present = blocks_to_send(share);
  const auto block = std::max<Index>(1, share.schur.block());
  const auto poses = static_cast<std::size_t>(share.schur.diagonal.cols() / block);
  encoded.diagonal = lower_triangles(gathered(share.schur.diagonal, present, 0));
  encoded.coupling = all_of(gathered(share.schur.coupling, present, poses));
  encoded.present = packed(present);
  for (const KeptEdge& e : share.edges) {
    encoded.edges.push_back(
        {.pair = 2 * static_cast<std::uint32_t>(e.pair) + (e.transposed ? 1 : 0),
         .kappa = e.kappa,
         .tau = e.tau,
         .T_i_j = to_wire(e.present)});
    if (share.curvature == Curvature::kFull) encoded.measured.push_back(to_wire(e.measured));
  }
  for (const KeyframeId& id : share.kept) encoded.kept.push_back(to_wire(id));
  for (const auto& [i, j] : share.pairs)
    encoded.pairs.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
  Wire& wire = encoded.wire;
  wire.robot = share.robot;
  wire.round = share.round;
  wire.cost = share.cost;
  wire.decrement = share.decrement;
  wire.block = static_cast<std::uint8_t>(share.block);
  wire.columns = static_cast<std::uint8_t>(share.reduced.cols());
  borrow(wire.reduced, encoded.reduced);
  borrow(wire.diagonal, encoded.diagonal);
  borrow(wire.coupling, encoded.coupling);
  wire.couplings = static_cast<std::uint32_t>(present.size() - poses);
  borrow(wire.kept, encoded.kept);
  borrow(wire.pairs, encoded.pairs);
  borrow(wire.present, encoded.present);
  borrow(wire.edges, encoded.edges);
  borrow(wire.measured, encoded.measured);
  return encoded;
}

Decoded<NewtonShare> Codec<NewtonShare>::decode(const Wire& wire) {
  using Result = Decoded<NewtonShare>;
  const Index B = wire.block;
  const Index columns = wire.columns;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  if (B < 1 || B > kMaxBlock || columns < 1 || columns > kMaxBlock)
    return Result::refuse("unknowns per pose or right-hand sides are out of range");
  const auto rows = static_cast<std::size_t>(B * columns);
  const auto reduced = elements_of(wire.reduced, kMaxKeptPoses * rows);
  const auto kept = elements_of(wire.kept, kMaxKeptPoses);
  const auto pairs = elements_of(wire.pairs, kMaxCouplings);
  if (!reduced || !kept || !pairs) return Result::refuse("a list is missing or too long");
  if (reduced->size() % rows != 0) return Result::refuse("a matrix is not made of blocks");
  const std::size_t poses = reduced->size() / rows;
  if (!kept->empty() && (kept->size() != poses || pairs->size() != wire.couplings))
    return Result::refuse("Schur complement and pattern differ in size");
  if (!all_finite(*reduced) || !std::isfinite(wire.cost) || !std::isfinite(wire.decrement))
    return Result::refuse("a number is not finite");
  auto second = second_derivatives_of(wire, poses);
  if (!second.value) return Result::refuse(second.refusal);

  NewtonShare share{.robot = wire.robot,
                    .round = wire.round,
                    .cost = wire.cost,
                    .decrement = wire.decrement,
                    .block = B,
                    .reduced = matrix_of(*reduced, static_cast<Index>(reduced->size()) / columns),
                    .schur = std::move(second.value->schur),
                    .curvature = second.value->curvature,
                    .edges = std::move(second.value->edges)};
  for (const km_wire_KeyframeRef& id : *kept) share.kept.push_back(from_wire(id));
  for (const km_wire_KeptPair& pair : *pairs) {
    if (pair.i >= pair.j || pair.j >= poses)
      return Result::refuse("a coupling names no two kept poses");
    share.pairs.push_back({static_cast<int>(pair.i), static_cast<int>(pair.j)});
  }
  return Result::accept(std::move(share));
}

}  // namespace km
