#include "modules/rbcd/truncated_newton.hpp"

#include <cmath>

namespace km {
namespace {

constexpr double kAcceptRatio = 0.1;  // least share of the predicted decrease
constexpr double kShrinkBelow = 0.25;
constexpr double kGrowAbove = 0.75;
constexpr double kLeastDecrease = 1e-15;  // relative to the cost
constexpr int kMaxRejections = 20;        // in a row; each one reduces the radius fourfold

double dot(const LiftedPoses& a, const LiftedPoses& b) {
  return a.cwiseProduct(b).sum();
}

struct Step {
  LiftedPoses V;
  double norm = 0.0;                // in the norm of the preconditioner
  double predicted_decrease = 0.0;  // by the quadratic model
  int cg_iterations = 0;
  bool on_boundary = false;
};

// Steihaug-Toint conjugate gradients; z is the preconditioned residual. e_e, e_d and d_d are
// products of the step e = V and the direction d in the inner product of the preconditioner.
Step solve_model(const QuadraticProblem& problem, const LiftedPoses& X,
                 const LiftedPoses& euclidean, const LiftedPoses& gradient, double radius,
                 const TruncatedNewtonOptions& options) {
  Step step{.V = LiftedPoses::Zero(X.rows(), X.cols())};
  LiftedPoses HV = step.V;
  LiftedPoses residual = gradient;
  LiftedPoses z = problem.precondition(X, residual);
  LiftedPoses d = -z;
  double z_r = dot(z, residual);
  double e_e = 0.0;
  double e_d = 0.0;
  double d_d = z_r;
  const double target = options.cg_tolerance * gradient.norm();
  while (step.cg_iterations < options.max_cg_iterations) {
    const LiftedPoses Hd = problem.hessian_product(X, euclidean, d);
    ++step.cg_iterations;
    const double curvature = dot(d, Hd);
    const double alpha = z_r / curvature;
    const double next_e_e = e_e + 2.0 * alpha * e_d + alpha * alpha * d_d;
    if (!(curvature > 0.0) || next_e_e >= radius * radius) {
      const double to_boundary =
          (-e_d + std::sqrt(e_d * e_d + d_d * (radius * radius - e_e))) / d_d;
      step.V += to_boundary * d;
      HV += to_boundary * Hd;
      e_e = radius * radius;
      step.on_boundary = true;
      break;
    }
    step.V += alpha * d;
    HV += alpha * Hd;
    e_e = next_e_e;
    residual += alpha * Hd;
    if (residual.norm() <= target) break;
    z = problem.precondition(X, residual);
    const double next_z_r = dot(z, residual);
    const double beta = next_z_r / z_r;
    z_r = next_z_r;
    e_d = beta * (e_d + alpha * d_d);
    d_d = z_r + beta * beta * d_d;
    d = beta * d - z;
  }
  step.norm = std::sqrt(e_e);
  step.predicted_decrease = -dot(gradient, step.V) - 0.5 * dot(step.V, HV);
  return step;
}

}  // namespace

TruncatedNewtonResult minimise(const QuadraticProblem& problem, LiftedPoses X,
                               const TruncatedNewtonOptions& options) {
  TruncatedNewtonResult result;
  result.initial_cost = result.cost = problem.cost(X);
  LiftedPoses euclidean = problem.euclidean_gradient(X);
  LiftedPoses gradient = project_tangent(X, euclidean);
  result.initial_gradient_norm = result.gradient_norm = gradient.norm();
  // In the norm of the preconditioner, a full Newton step of a least-squares cost has a length of
  // about sqrt(2 cost) at most, if the quadratic model is exact. The first radius is larger.
  double radius = 10.0 * std::sqrt(std::max(result.cost, 1e-12));
  bool last = false;
  int rejected = 0;
  while (result.iterations < options.max_iterations && rejected < kMaxRejections && !last &&
         result.gradient_norm > options.gradient_tolerance) {
    const Step step = solve_model(problem, X, euclidean, gradient, radius, options);
    result.cg_iterations += step.cg_iterations;
    // Stops at a decrease below rounding, because further steps would be random.
    last = !(step.predicted_decrease > kLeastDecrease * result.cost);
    if (last) break;
    LiftedPoses candidate = retract(X, step.V);
    const double cost = problem.cost(candidate);
    const double ratio = (result.cost - cost) / step.predicted_decrease;
    if (!(ratio >= kShrinkBelow)) radius = kShrinkBelow * step.norm;
    if (ratio > kGrowAbove && step.on_boundary) radius *= 2.0;
    if (!(ratio > kAcceptRatio) || !(cost < result.cost)) {
      ++rejected;
      continue;
    }
    rejected = 0;
    ++result.iterations;
    X = std::move(candidate);
    result.cost = cost;
    euclidean = problem.euclidean_gradient(X);
    gradient = project_tangent(X, euclidean);
    result.gradient_norm = gradient.norm();
  }
  result.X = std::move(X);
  result.radius = radius;
  result.converged =
      last || rejected == kMaxRejections || result.gradient_norm <= options.gradient_tolerance;
  return result;
}

TruncatedNewtonResult minimise_over_relaxed(const QuadraticProblem& problem, const LiftedPoses& X,
                                            const TruncatedNewtonOptions& options,
                                            double relaxation) {
  TruncatedNewtonResult result = minimise(problem, X, options);
  if (relaxation <= 1.0) return result;
  const LiftedPoses step = project_tangent(result.X, result.X - X);
  LiftedPoses beyond = retract(result.X, (relaxation - 1.0) * step);
  const double cost = problem.cost(beyond);
  if (cost < result.initial_cost) {
    result.X = std::move(beyond);
    result.cost = cost;
  }
  return result;
}

}  // namespace km
