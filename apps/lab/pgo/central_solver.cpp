#include "apps/lab/pgo/central_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/lab/pgo/team_graph.hpp"
#include "modules/rbcd/stiefel.hpp"
#include "modules/rbcd/truncated_newton.hpp"

namespace km {
namespace {

// Smaller than the default of QuadraticProblem: near a minimum a small shift converges faster.
constexpr double kShiftFromStart = 1e-4;
// Convergence is superlinear. When a step decreases the cost by less than the first value, the
// poses are certified. If that fails, further steps follow, until one gains less than the second
// value. Only then is the rank increased.
constexpr double kRelativeDecrease = 3e-6;
constexpr double kLeastRelativeDecrease = 1e-10;
constexpr Eigen::Index kMaxRank = 10;
constexpr int kMaxIterations = 300;  // Newton steps at one rank
constexpr double kCgTolerance = 0.1;
constexpr int kMaxCgIterations = 2000;

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

Staircase::Staircase(std::vector<BlockEdge> edges, LiftedPoses start,
                     std::vector<VerticalPrior> verticals)
    : problem_(start.rows(), pose_count(start), std::move(edges), {}, std::move(verticals)),
      X_(std::move(start)) {
  problem_.set_rotation_shift(kShiftFromStart);
  restart();
}

void Staircase::restart_at_minimum(LiftedPoses X) {
  X_ = std::move(X);
  certificate_.reset();
  restart();
  last_decrease_ = sufficient_decrease_;
}

bool Staircase::step() {
  if (certificate_ && !resume()) return false;
  if (last_decrease_ <= sufficient_decrease_ || iterations_ >= kMaxIterations) {
    certificate_ = certify(problem_, X_);
    return true;
  }
  const double residual = initial_gradient_ > 0.0 ? gradient_ / initial_gradient_ : 1.0;
  TruncatedNewtonResult result =
      minimise(problem_, std::move(X_),
               {.max_iterations = 1,
                .max_cg_iterations = kMaxCgIterations,
                .cg_tolerance = std::min(kCgTolerance, std::sqrt(residual)),
                .gradient_tolerance = 0.0,
                .initial_radius = radius_});
  X_ = std::move(result.X);
  radius_ = result.radius;
  gradient_ = result.gradient_norm;
  if (iterations_++ == 0) initial_gradient_ = result.initial_gradient_norm;
  last_decrease_ =
      result.converged ? 0.0 : (result.initial_cost - result.cost) / result.initial_cost;
  return true;
}

// Prepares the next steps after a verification. False: nothing is left to do.
bool Staircase::resume() {
  if (certificate_->certified) return false;
  if (last_decrease_ > kLeastRelativeDecrease) {
    last_decrease_ = std::numeric_limits<double>::infinity();
    sufficient_decrease_ = 1.0;  // one more step, whatever its gain
  } else if (X_.rows() < kMaxRank && certificate_->lambda_min) {
    climb();
  } else {
    return false;
  }
  certificate_.reset();
  return true;
}

void Staircase::climb() {
  QuadraticProblem higher(X_.rows() + 1, problem_.poses(), problem_.edges(), {},
                          problem_.verticals());
  higher.set_rotation_shift(kShiftFromStart);
  X_ = escape(higher, X_, certificate_->direction);
  problem_ = std::move(higher);
  restart();
}

void Staircase::restart() {
  iterations_ = 0;
  radius_ = 0.0;
  gradient_ = initial_gradient_ = 0.0;
  last_decrease_ = 1.0;
  sufficient_decrease_ = kRelativeDecrease;
}

CentralSolver::CentralSolver(const std::vector<BlockEdge>& edges, LiftedPoses start, int dimension,
                             std::vector<VerticalPrior> verticals)
    : staircase_(edges, start, verticals) {
  if (!rigid(start)) return;
  SessionGraph graph{.start = round_to_poses(start, lifted_identity(3))};
  for (const BlockEdge& e : edges) graph.own.push_back(e.of_one_robot());
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
