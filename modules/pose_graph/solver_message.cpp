#include "modules/pose_graph/solver_message.hpp"

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
  // Of the symmetric blocks on the diagonal only the lower triangles travel.
  const Eigen::Index triangles = share.schur.diagonal.cols() * (share.block + 1) / 2;
  const Eigen::Index values = share.reduced.size() + triangles + share.schur.coupling.size();
  return 8 * (static_cast<std::size_t>(values) + share.kept.size() + share.pairs.size());
}

}  // namespace

std::size_t approximate_bytes(const SolverMessage& message) {
  return kEnvelope +
         std::visit([](const auto& content) { return bytes_of(content); }, message.content);
}

}  // namespace km
