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

// Of the symmetric blocks on the diagonal only the lower triangles travel.
template <typename Share>
std::size_t numbers_of(const Share& share) {
  const Eigen::Index triangles = share.schur.diagonal.cols() * (share.block + 1) / 2;
  return static_cast<std::size_t>(share.reduced.size() + triangles + share.schur.coupling.size());
}

std::size_t bytes_of(const NewtonShare& share) {
  return 8 * (numbers_of(share) + share.kept.size() + share.pairs.size());
}

std::size_t bytes_of(const GncHello& hello) {
  return 88 * hello.links.size() + 60 * hello.poses.size() + 8 * hello.pairs.size() +
         4 * hello.residuals.size();
}

std::size_t bytes_of(const GncShare& share) {
  return 8 * numbers_of(share) + 4 * share.residuals.size();
}

}  // namespace

std::size_t approximate_bytes(const SolverMessage& message) {
  return kEnvelope +
         std::visit([](const auto& content) { return bytes_of(content); }, message.content);
}

}  // namespace km
