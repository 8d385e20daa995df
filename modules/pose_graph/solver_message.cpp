#include "modules/pose_graph/solver_message.hpp"

#include <algorithm>

#include "modules/pose_graph/newton/wire_blocks.hpp"

namespace km {
namespace {

constexpr std::size_t kEnvelope = 100;

std::size_t bytes_of(const SolverGivesUp& /*content*/) {
  return 0;
}

std::size_t bytes_of(const NewtonHello& hello) {
  return 12 * hello.links.size() + 4 * hello.poses.size() + 56 * hello.T_world_pose.size();
}

std::size_t bytes_of(const NewtonShare& share) {
  const std::vector<bool> present = blocks_to_send(share);
  const auto B = std::max<Eigen::Index>(1, share.block);
  const auto couplings = present.begin() + share.schur.diagonal.cols() / B;
  const auto numbers = share.reduced.size() +
                       std::count(present.begin(), couplings, true) * B * (B + 1) / 2 +
                       std::count(couplings, present.end(), true) * B * B;
  const std::size_t edge = share.curvature == Curvature::kFull ? 68 : 40;
  return 8 * (static_cast<std::size_t>(numbers) + share.kept.size() + share.pairs.size()) +
         edge * share.edges.size() + present.size() / 8;
}

std::size_t bytes_of(const GncHello& hello) {
  return 88 * hello.links.size() + 60 * hello.poses.size() + 8 * hello.pairs.size() +
         4 * hello.residuals.size();
}

std::size_t bytes_of(const GncShare& share) {
  // Of the symmetric blocks on the diagonal only the lower triangles travel.
  const Eigen::Index triangles = share.schur.diagonal.cols() * (share.block + 1) / 2;
  const auto numbers = share.reduced.size() + triangles + share.schur.coupling.size();
  return 8 * static_cast<std::size_t>(numbers) + 4 * share.residuals.size();
}

}  // namespace

std::size_t approximate_bytes(const SolverMessage& message) {
  return kEnvelope +
         std::visit([](const auto& content) { return bytes_of(content); }, message.content);
}

}  // namespace km
