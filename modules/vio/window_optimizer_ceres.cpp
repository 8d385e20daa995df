#include <ceres/ceres.h>

#include <memory>
#include <vector>

#include "modules/vio/residuals/imu_cost.hpp"
#include "modules/vio/residuals/pose_block.hpp"
#include "modules/vio/residuals/prior_cost.hpp"
#include "modules/vio/residuals/reprojection_cost.hpp"
#include "modules/vio/window_optimizer.hpp"

namespace km {
namespace {

// A window as parameter blocks. The problem refers to blocks, loss and manifold: they come first.
struct WindowProblem {
  explicit WindowProblem(const Window& window);
  void write_to(Window& window) const;

  struct StateBlocks {
    PoseBlock pose;
    MotionBlock motion;
  };
  // Ceres orders the blocks of an elimination group by address: in one vector that is by frame,
  // and repeatable.
  std::vector<StateBlocks> states;
  std::vector<Eigen::Vector3d> points;
  ceres::CauchyLoss loss;
  PoseManifold manifold;
  ceres::Problem problem;
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering =
      std::make_shared<ceres::ParameterBlockOrdering>();

 private:
  void add_frames(const Window& window, const std::vector<FirstEstimate>& held);
  void add_landmarks(const Window& window, const std::vector<FirstEstimate>& held);
  void add_prior(const Window& window);
};

ceres::Problem::Options shared_objects() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;  // thousands of blocks for every image
  return options;
}

WindowProblem::WindowProblem(const Window& window)
    : loss(window.loss_scale), problem(shared_objects()) {
  for (const WindowFrame& frame : window.frames)
    states.push_back({pose_block(frame.state.T_odom_body), motion_block(frame.state)});
  for (const WindowLandmark& landmark : window.landmarks) points.push_back(landmark.p_odom);
  const std::vector<FirstEstimate> held = first_estimates(window);
  add_frames(window, held);
  add_landmarks(window, held);
  add_prior(window);
}

void WindowProblem::add_frames(const Window& window, const std::vector<FirstEstimate>& held) {
  for (std::size_t k = 0; k < window.frames.size(); ++k) {
    problem.AddParameterBlock(states[k].pose.data(), 7, &manifold);
    problem.AddParameterBlock(states[k].motion.data(), 9);
    ordering->AddElementToGroup(states[k].pose.data(), 1);
    ordering->AddElementToGroup(states[k].motion.data(), 1);
    if (k > 0 && window.frames[k].imu)
      problem.AddResidualBlock(new ImuCost(*window.frames[k].imu, held[k - 1], held[k]), nullptr,
                               states[k - 1].pose.data(), states[k - 1].motion.data(),
                               states[k].pose.data(), states[k].motion.data());
  }
}

void WindowProblem::add_landmarks(const Window& window, const std::vector<FirstEstimate>& held) {
  for (std::size_t l = 0; l < window.landmarks.size(); ++l) {
    const WindowLandmark& landmark = window.landmarks[l];
    if (!landmark.located || landmark.observations.size() < 2) continue;
    ordering->AddElementToGroup(points[l].data(), 0);  // eliminated first
    for (const WindowObservation& o : landmark.observations)
      for (std::size_t c = 0; c < 2; ++c)
        if (o.bearings[c])
          problem.AddResidualBlock(
              new ReprojectionCost(window.views[c], *o.bearings[c], held[o.frame].pose), &loss,
              states[o.frame].pose.data(), points[l].data());
  }
}

void WindowProblem::add_prior(const Window& window) {
  if (window.prior.frames.empty()) return;
  std::vector<double*> parameters;
  for (const std::uint64_t id : window.prior.frames) {
    const std::size_t k = frame_index(window, id);
    parameters.push_back(states[k].pose.data());
    if (parameters.size() == 1) parameters.push_back(states[k].motion.data());
  }
  problem.AddResidualBlock(new PriorCost(window.prior), nullptr, parameters);
}

void WindowProblem::write_to(Window& window) const {
  for (std::size_t k = 0; k < states.size(); ++k) {
    const Stamp stamp = window.frames[k].state.stamp;
    window.frames[k].state = state_of(states[k].pose.data(), states[k].motion.data());
    window.frames[k].state.stamp = stamp;
  }
  for (std::size_t l = 0; l < points.size(); ++l) window.landmarks[l].p_odom = points[l];
}

}  // namespace

WindowSolution optimize_by_ceres(Window& window, int max_iterations) {
  WindowProblem problem(window);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = problem.ordering;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  options.max_solver_time_in_seconds = 1e9;  // iterations bound the work: repeatable
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem.problem, &summary);
  const bool usable = summary.IsSolutionUsable();
  if (usable) problem.write_to(window);
  return {static_cast<int>(summary.iterations.size()) - 1, summary.initial_cost, summary.final_cost,
          usable};
}

}  // namespace km
