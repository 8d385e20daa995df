#include "modules/pose_graph/session_solver.hpp"

#include <stdexcept>
#include <utility>

#include "modules/pose_graph/newton/newton_session_solver.hpp"
#include "modules/pose_graph/robust/gnc_session_solver.hpp"

namespace km {

std::unique_ptr<SessionSolver> make_session_solver(PgoMethod method, double gnc_barc,
                                                   RobotEdges edges, std::set<RobotId> members,
                                                   std::vector<SE3> start, bool upright) {
  switch (method) {
    case PgoMethod::kNewton:
      return std::make_unique<NewtonSessionSolver>(std::move(edges), std::move(members),
                                                   std::move(start), upright);
    case PgoMethod::kGnc:
      return std::make_unique<GncSessionSolver>(std::move(edges), std::move(members),
                                                std::move(start), gnc_barc);
    case PgoMethod::kRbcd:
      break;
  }
  throw std::invalid_argument(std::string("make_session_solver: '") + to_string(method) +
                              "' does not go by exchanges");
}

}  // namespace km
