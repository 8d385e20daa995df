#include "modules/vio/window_optimizer.hpp"

#include <ceres/ceres.h>

#include <cmath>
#include <vector>

#include "modules/vio/residuals/pose_block.hpp"
#include "modules/vio/residuals/prior_cost.hpp"
#include "modules/vio/window_equations.hpp"

namespace km {
namespace {

constexpr double kInitialDamping = 1e-6;
constexpr double kMaxDamping = 1e3;
constexpr double kSmallStep = 1e-6;  // largest of rad, m, m/s: far below what images resolve

// What an iteration changes, to take it back.
struct Snapshot {
  std::vector<OdometryState> states;
  std::vector<Eigen::Vector3d> points;

  explicit Snapshot(const Window& window) {
    for (const WindowFrame& frame : window.frames) states.push_back(frame.state);
    for (const WindowLandmark& landmark : window.landmarks) points.push_back(landmark.p_odom);
  }
  void restore(Window& window) const {
    for (std::size_t k = 0; k < states.size(); ++k) window.frames[k].state = states[k];
    for (std::size_t k = 0; k < points.size(); ++k) window.landmarks[k].p_odom = points[k];
  }
};

struct Blocks {
  std::vector<PoseBlock> poses;
  std::vector<MotionBlock> motions;
  std::vector<Eigen::Vector3d> points;
};

void add_landmarks(const Window& window, Blocks& blocks, ceres::ParameterBlockOrdering& ordering,
                   ceres::Problem& problem) {
  for (std::size_t l = 0; l < window.landmarks.size(); ++l) {
    const WindowLandmark& landmark = window.landmarks[l];
    if (!landmark.located || landmark.observations.size() < 2) continue;
    ordering.AddElementToGroup(blocks.points[l].data(), 0);
    for (const WindowObservation& o : landmark.observations)
      for (std::size_t c = 0; c < 2; ++c)
        if (o.bearings[c])
          problem.AddResidualBlock(new ReprojectionCost(window.views[c], *o.bearings[c]),
                                   new ceres::CauchyLoss(window.loss_scale),
                                   blocks.poses[o.frame].data(), blocks.points[l].data());
  }
}

void add_prior(const Window& window, Blocks& blocks, ceres::Problem& problem) {
  if (window.prior.frames.empty()) return;
  std::vector<double*> parameters;
  for (const std::uint64_t id : window.prior.frames) {
    const std::size_t k = frame_index(window, id);
    parameters.push_back(blocks.poses[k].data());
    if (parameters.size() == 1) parameters.push_back(blocks.motions[k].data());
  }
  problem.AddResidualBlock(new PriorCost(window.prior), nullptr, parameters);
}

}  // namespace

WindowSolution optimize(Window& window, int max_iterations) {
  WindowSolution result;
  result.initial_cost = result.final_cost = window_cost(window);
  double damping = kInitialDamping;
  while (result.iterations < max_iterations && damping < kMaxDamping) {
    ++result.iterations;
    WindowEquations equations(window, damping);
    equations.add_all();
    const Eigen::VectorXd dx = equations.solve();
    const Snapshot before(window);
    if (dx.size() > 0) equations.apply(dx, window);
    const double cost = window_cost(window);
    if (dx.size() == 0 || !(cost <= result.final_cost * (1.0 + 1e-6))) {
      before.restore(window);
      damping *= 100.0;
      continue;
    }
    result.final_cost = cost;
    damping = std::max(0.1 * damping, 1e-9);
    if (dx.cwiseAbs().maxCoeff() < kSmallStep) break;
  }
  result.usable = std::isfinite(result.final_cost);
  return result;
}

WindowSolution optimize_by_ceres(Window& window, int max_iterations) {
  Blocks blocks;
  for (const WindowFrame& frame : window.frames) {
    blocks.poses.push_back(pose_block(frame.state.T_odom_body));
    blocks.motions.push_back(motion_block(frame.state));
  }
  for (const WindowLandmark& landmark : window.landmarks) blocks.points.push_back(landmark.p_odom);

  ceres::Problem problem;
  const auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t k = 0; k < window.frames.size(); ++k) {
    problem.AddParameterBlock(blocks.poses[k].data(), 7, new PoseManifold);
    problem.AddParameterBlock(blocks.motions[k].data(), 9);
    ordering->AddElementToGroup(blocks.poses[k].data(), 1);
    ordering->AddElementToGroup(blocks.motions[k].data(), 1);
    if (k > 0 && window.frames[k].imu)
      problem.AddResidualBlock(new ImuCost(*window.frames[k].imu), nullptr,
                               blocks.poses[k - 1].data(), blocks.motions[k - 1].data(),
                               blocks.poses[k].data(), blocks.motions[k].data());
  }
  add_landmarks(window, blocks, *ordering, problem);
  add_prior(window, blocks, problem);

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = ordering;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  options.max_solver_time_in_seconds = 1e9;  // iterations bound the work: repeatable
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  WindowSolution result{static_cast<int>(summary.iterations.size()), summary.initial_cost,
                        summary.final_cost, summary.IsSolutionUsable()};
  if (!result.usable) return result;
  for (std::size_t k = 0; k < window.frames.size(); ++k) {
    const Stamp stamp = window.frames[k].state.stamp;
    window.frames[k].state = state_of(blocks.poses[k].data(), blocks.motions[k].data());
    window.frames[k].state.stamp = stamp;
  }
  for (std::size_t l = 0; l < blocks.points.size(); ++l)
    window.landmarks[l].p_odom = blocks.points[l];
  return result;
}

}  // namespace km
