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
  encoded.diagonal = lower_triangles(share.schur.diagonal);
  encoded.coupling = all_of(share.schur.coupling);
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
  borrow(wire.kept, encoded.kept);
  borrow(wire.pairs, encoded.pairs);
  return encoded;
}

Decoded<NewtonShare> Codec<NewtonShare>::decode(const Wire& wire) {
  using Result = Decoded<NewtonShare>;
  const Index B = wire.block;
  const Index columns = wire.columns;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  if (B < 1 || B > kMaxBlock || columns < 1 || columns > kMaxBlock)
    return Result::refuse("unknowns per pose or right-hand sides are out of range");
  const auto block = static_cast<std::size_t>(B * B);
  const auto triangle = static_cast<std::size_t>(B * (B + 1) / 2);
  const auto rows = static_cast<std::size_t>(B * columns);
  const auto reduced = elements_of(wire.reduced, kMaxKeptPoses * rows);
  const auto diagonal = elements_of(wire.diagonal, kMaxKeptPoses * triangle);
  const auto coupling = elements_of(wire.coupling, kMaxCouplings * block);
  const auto kept = elements_of(wire.kept, kMaxKeptPoses);
  const auto pairs = elements_of(wire.pairs, kMaxCouplings);
  if (!reduced || !diagonal || !coupling || !kept || !pairs)
    return Result::refuse("a list is missing or too long");
  if (reduced->size() % rows != 0 || coupling->size() % block != 0)
    return Result::refuse("a matrix is not made of blocks");
  const std::size_t poses = reduced->size() / rows;
  if (!diagonal->empty() && diagonal->size() != poses * triangle)
    return Result::refuse("right-hand side and Schur complement differ in size");
  if (!kept->empty() && (kept->size() != poses || pairs->size() * block != coupling->size()))
    return Result::refuse("Schur complement and pattern differ in size");
  if (!all_finite(*reduced) || !all_finite(*diagonal) || !all_finite(*coupling) ||
      !std::isfinite(wire.cost) || !std::isfinite(wire.decrement))
    return Result::refuse("a number is not finite");

  NewtonShare share{.robot = wire.robot,
                    .round = wire.round,
                    .cost = wire.cost,
                    .decrement = wire.decrement,
                    .block = B};
  share.reduced = matrix_of(*reduced, static_cast<Index>(reduced->size()) / columns);
  if (!diagonal->empty())
    share.schur = {from_lower_triangles(*diagonal, B), matrix_of(*coupling, B)};
  for (const km_wire_KeyframeRef& id : *kept) share.kept.push_back(from_wire(id));
  for (const km_wire_KeptPair& pair : *pairs) {
    if (pair.i >= pair.j || pair.j >= poses)
      return Result::refuse("a coupling names no two kept poses");
    share.pairs.push_back({static_cast<int>(pair.i), static_cast<int>(pair.j)});
  }
  return Result::accept(std::move(share));
}

}  // namespace km
