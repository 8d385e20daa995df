#include "modules/pose_graph/newton/newton_session_solver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace km {
namespace {

constexpr int kDimension = 3;

// [sigma^2], of the whole team's cost: no decision hangs on it. Where measurements do not
// contradict each other the cost is 0, and a relative tolerance would never be met.
constexpr double kNegligible = 1e-9;

// Second derivatives are worth some fifty right-hand sides in bytes.
constexpr double kPatience = 30.0;

}  // namespace

NewtonSessionSolver::NewtonSessionSolver(RobotEdges edges, std::set<RobotId> members,
                                         std::vector<SE3> start, bool upright)
    : agent_(
          std::move(edges), std::move(members), kDimension,
          NewtonOptions{
              .absolute_tolerance = kNegligible, .patience_rounds = kPatience, .upright = upright},
          std::move(start)) {}

void NewtonSessionSolver::receive(const SolverMessagePtr& message) {
  if (const auto* hello = std::get_if<NewtonHello>(&message->content)) agent_.receive(*hello);
  if (const auto* share = std::get_if<NewtonShare>(&message->content))
    agent_.receive(std::shared_ptr<const NewtonShare>(message, share));
}

std::optional<SolverContent> NewtonSessionSolver::advance() {
  if (auto share = agent_.advance()) return std::move(*share);
  return std::nullopt;
}

SolverProgress NewtonSessionSolver::progress() const {
  return {agent_.cost().value_or(0.0), std::sqrt(std::max(0.0, agent_.decrement()))};
}

}  // namespace km
