#include "apps/lab/pgo/central_solver.hpp"

#include "apps/lab/pgo/team_graph.hpp"
#include "modules/rbcd/rounding.hpp"

namespace km {
namespace {

constexpr std::uint32_t kMaxRounds = 300;
// See TreeNewtonOptions::patience_rounds. Below its default, because new second derivatives cost no
// messages on one computer.
constexpr double kPatience = 8.0;

bool rigid(const LiftedPoses& X) {
  if (X.rows() != 3) return false;
  for (Eigen::Index i = 0; i < pose_count(X); ++i)
    if (!(X.middleCols<3>(4 * i).determinant() > 0.0)) return false;
  return true;
}

}  // namespace

CentralSolver::CentralSolver(const std::vector<BlockEdge>& edges, LiftedPoses start, int dimension,
                             std::vector<VerticalPrior> verticals)
    : staircase_(edges, start, verticals) {
  if (!rigid(start)) return;
  SessionGraph graph{.start = round_to_poses(start, lifted_identity(3))};
  for (const BlockEdge& e : edges) graph.own.push_back(edge_of_one_robot(e));
  graph.upright = !verticals.empty();
  graph.verticals = std::move(verticals);
  newton_ = std::make_unique<TreeNewton>(std::move(graph), TreePlace{.members = {0}},
                                         TreeNewtonOptions{.dimension = dimension,
                                                           .absolute_tolerance = 0.0,
                                                           .patience_rounds = kPatience,
                                                           .max_rounds = kMaxRounds,
                                                           .robust = false,
                                                           .covariances = false});
  X_ = std::move(start);
}

bool CentralSolver::step() {
  if (!newton_) return staircase_.step();
  (void)newton_->advance();  // a team of one sends no messages
  X_ = lift(newton_->poses(), 3);
  if (newton_->done()) {
    staircase_.restart_at_minimum(std::move(X_));
    newton_.reset();
  }
  return true;
}

}  // namespace km
