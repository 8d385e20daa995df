#include "modules/pose_graph/robust/gnc_codec.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
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

bool are_residuals(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(),
                     [](float r) { return std::isfinite(r) && r >= 0.0F; });
}

bool is_precision(double x) {
  return std::isfinite(x) && x > 0.0;
}

km_wire_GncLink link_to_wire(const GncLink& link) {
  return {.own = link.own,
          .other = to_wire(link.other),
          .odometry = link.odometry,
          .from_own = link.from_own,
          .T_from_to = to_wire(link.T_from_to),
          .kappa = link.kappa,
          .tau = link.tau};
}

std::optional<GncLink> link_from_wire(const km_wire_GncLink& wire) {
  const std::optional<SE3> T = from_wire(wire.T_from_to);
  if (!T || !is_precision(wire.kappa) || !is_precision(wire.tau)) return std::nullopt;
  return GncLink{wire.own, from_wire(wire.other), wire.odometry, wire.from_own, *T, wire.kappa,
                 wire.tau};
}

}  // namespace

Codec<GncHello>::Encoded Codec<GncHello>::encode(const GncHello& hello) {
  Encoded encoded;
  for (const GncLink& link : hello.links) encoded.links.push_back(link_to_wire(link));
  encoded.poses = hello.poses;
  for (const SE3& T : hello.T_start_pose) encoded.T_start_pose.push_back(to_wire(T));
  for (const auto& [i, j] : hello.pairs)
    encoded.pairs.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
  encoded.residuals = hello.residuals;
  Wire& wire = encoded.wire;
  wire.robot = hello.robot;
  wire.barc = hello.barc;
  wire.common_frame = hello.common_frame;
  wire.closures = hello.closures;
  borrow(wire.links, encoded.links);
  borrow(wire.poses, encoded.poses);
  borrow(wire.T_start_pose, encoded.T_start_pose);
  borrow(wire.pairs, encoded.pairs);
  borrow(wire.residuals, encoded.residuals);
  return encoded;
}

Decoded<GncHello> Codec<GncHello>::decode(const Wire& wire) {
  using Result = Decoded<GncHello>;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  const auto links = elements_of(wire.links, kMaxGncEntries);
  const auto poses = elements_of(wire.poses, kMaxGncEntries);
  const auto T_start_pose = elements_of(wire.T_start_pose, kMaxGncEntries);
  const auto pairs = elements_of(wire.pairs, kMaxGncPairs);
  const auto residuals = elements_of(wire.residuals, kMaxGncEntries);
  if (!links || !poses || !T_start_pose || !pairs || !residuals)
    return Result::refuse("a list is missing or too long");
  if (poses->size() != T_start_pose->size())
    return Result::refuse("poses and their values differ in number");
  if (std::adjacent_find(poses->begin(), poses->end(), std::greater_equal<>()) != poses->end())
    return Result::refuse("poses out of order");
  if (wire.closures > residuals->size()) return Result::refuse("fewer residuals than closures");
  if (!are_residuals(*residuals)) return Result::refuse("a residual is negative or not a number");
  if (!std::isfinite(wire.barc) || wire.barc < 0.0) return Result::refuse("barc is no threshold");
  GncHello hello{.robot = wire.robot,
                 .barc = wire.barc,
                 .poses = {poses->begin(), poses->end()},
                 .common_frame = wire.common_frame,
                 .closures = wire.closures,
                 .residuals = {residuals->begin(), residuals->end()}};
  for (const km_wire_GncLink& link : *links) {
    const std::optional<GncLink> decoded = link_from_wire(link);
    if (!decoded) return Result::refuse("a link is no measurement");
    if (decoded->other.robot <= wire.robot) return Result::refuse("a link to a lower robot");
    hello.links.push_back(*decoded);
  }
  for (const km_wire_Pose& pose : *T_start_pose) {
    const std::optional<SE3> T = from_wire(pose);
    if (!T) return Result::refuse("a pose is not a rigid transform");
    hello.T_start_pose.push_back(*T);
  }
  for (const km_wire_GncPair& pair : *pairs) {
    if (pair.i >= pair.j || pair.j >= poses->size())
      return Result::refuse("a coupling names no two public poses");
    hello.pairs.push_back({static_cast<int>(pair.i), static_cast<int>(pair.j)});
  }
  return Result::accept(std::move(hello));
}

Codec<GncShare>::Encoded Codec<GncShare>::encode(const GncShare& share) {
  Encoded encoded;
  const Eigen::MatrixXd& coupling = share.schur.coupling;
  encoded.reduced.assign(share.reduced.begin(), share.reduced.end());
  encoded.diagonal = lower_triangles(share.schur.diagonal);
  encoded.coupling.assign(coupling.data(), coupling.data() + coupling.size());
  encoded.residuals = share.residuals;
  Wire& wire = encoded.wire;
  wire.robot = share.robot;
  wire.round = share.round;
  wire.base_cost = share.base_cost;
  wire.cost = share.cost;
  wire.decrement = share.decrement;
  wire.block = static_cast<std::uint8_t>(share.block);
  borrow(wire.reduced, encoded.reduced);
  borrow(wire.diagonal, encoded.diagonal);
  borrow(wire.coupling, encoded.coupling);
  borrow(wire.residuals, encoded.residuals);
  return encoded;
}

Decoded<GncShare> Codec<GncShare>::decode(const Wire& wire) {
  using Result = Decoded<GncShare>;
  const Index B = wire.block;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  if (B < 1 || B > kMaxBlock) return Result::refuse("unknowns per pose are out of range");
  const auto rows = static_cast<std::size_t>(B);
  const std::size_t triangle = rows * (rows + 1) / 2;
  const auto reduced = elements_of(wire.reduced, kMaxGncEntries * rows);
  const auto diagonal = elements_of(wire.diagonal, kMaxGncEntries * triangle);
  const auto coupling = elements_of(wire.coupling, kMaxGncPairs * rows * rows);
  const auto residuals = elements_of(wire.residuals, kMaxGncEntries);
  if (!reduced || !diagonal || !coupling || !residuals)
    return Result::refuse("a list is missing or too long");
  if (reduced->size() % rows != 0 || coupling->size() % (rows * rows) != 0)
    return Result::refuse("a matrix is not made of blocks");
  if (diagonal->empty() ? !coupling->empty()
                        : diagonal->size() != reduced->size() / rows * triangle)
    return Result::refuse("right-hand side and Schur complement differ in size");
  if (!all_finite(*reduced) || !all_finite(*diagonal) || !all_finite(*coupling) ||
      !std::isfinite(wire.base_cost) || !std::isfinite(wire.cost) || !std::isfinite(wire.decrement))
    return Result::refuse("a number is not finite");
  if (!are_residuals(*residuals)) return Result::refuse("a residual is negative or not a number");
  GncShare share{.robot = wire.robot,
                 .round = wire.round,
                 .base_cost = wire.base_cost,
                 .cost = wire.cost,
                 .decrement = wire.decrement,
                 .block = B,
                 .residuals = {residuals->begin(), residuals->end()}};
  share.reduced =
      Eigen::Map<const Eigen::VectorXd>(reduced->data(), static_cast<Index>(reduced->size()));
  if (!diagonal->empty())
    share.schur = {from_lower_triangles(*diagonal, B),
                   Eigen::Map<const Eigen::MatrixXd>(coupling->data(), B,
                                                     static_cast<Index>(coupling->size()) / B)};
  return Result::accept(std::move(share));
}

}  // namespace km
