#include "modules/rbcd/solver_choice.hpp"

#include <utility>

#include "modules/robust/tree_newton.hpp"

namespace km {

TreeNewtonOptions newton_options(const PoseGraphConfig& config) {
  TreeNewtonOptions options;
  options.robust = config.robust;
  options.barc = config.barc;
  // Below the default of 30, so that new second derivatives are sent earlier and a session has
  // fewer rounds. In a team, the latency of a round costs more than the bytes of second
  // derivatives.
  options.patience_rounds = 8.0;
  return options;
}

MemberSolverFactory solver_choice(const PoseGraphConfig& config, int dimension) {
  return [config, dimension](const Session& session, SessionGraph graph,
                             TreePlace place) -> std::unique_ptr<MemberSolver> {
    if (session.method == PgoMethod::kRbcd) {
      return std::make_unique<MemberRbcd>(std::move(graph), place,
                                          RbcdOptions{.max_rounds = session.max_rounds});
    }
    TreeNewtonOptions options = newton_options(config);
    options.dimension = dimension;
    if (session.max_rounds > 0) options.max_rounds = session.max_rounds;
    return std::make_unique<TreeNewton>(std::move(graph), std::move(place), options);
  };
}

}  // namespace km
