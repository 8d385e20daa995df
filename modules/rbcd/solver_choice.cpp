#include "modules/rbcd/solver_choice.hpp"

#include <utility>

#include "modules/pose_graph/tree_newton.hpp"
#include "modules/rbcd/member_rbcd.hpp"

namespace km {
namespace {

// In a team, the latency of a round costs more than the bytes of new second derivatives.
constexpr double kPatienceRounds = 8.0;

TreeNewtonOptions newton_options(const PoseGraphConfig& config, const Session& session) {
  TreeNewtonOptions options;
  options.robust = config.robust;
  options.barc = config.barc;
  options.tell_private = config.tell_private;
  options.patience_rounds = kPatienceRounds;
  if (session.max_rounds > 0) options.max_rounds = session.max_rounds;
  return options;
}

RbcdOptions rbcd_options(const PoseGraphConfig& config, const Session& session) {
  return {.rank = config.rank,
          .max_rounds = session.max_rounds,
          .min_relative_decrease = config.min_relative_decrease,
          .max_newton_steps = config.max_newton_steps,
          .max_cg_iterations = config.max_cg_iterations,
          .max_over_relaxation = config.max_over_relaxation};
}

}  // namespace

MemberSolverFactory solver_choice(const PoseGraphConfig& config) {
  return [config](const Session& session, SessionGraph graph,
                  TreePlace place) -> std::unique_ptr<MemberSolver> {
    if (session.method == PgoMethod::kRbcd)
      return std::make_unique<MemberRbcd>(std::move(graph), place, rbcd_options(config, session));
    return std::make_unique<TreeNewton>(std::move(graph), std::move(place),
                                        newton_options(config, session));
  };
}

}  // namespace km
