#include "window_optimizer_ceres.hpp"

#include <ceres/ceres.h>

#include <memory>
#include <optional>
#include <vector>

#include "modules/core/lie.hpp"

namespace km {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A frame of the window by 15 parameters: the local coordinates of its pose about where it stood at
// first, then velocity, gyro bias and accelerometer bias.
struct Chart {
  OdometryState origin;
  FirstEstimate held;

  [[nodiscard]] Vector15 parameters() const {
    Vector15 x;
    x << Vector6::Zero(), origin.v_odom, origin.gyro_bias, origin.accel_bias;
    return x;
  }
  [[nodiscard]] OdometryState state(const double* x) const {
    OdometryState state = origin;
    state.T_odom_body = retract(origin.T_odom_body, Eigen::Map<const Vector6>(x));
    state.v_odom = Eigen::Map<const Eigen::Vector3d>(x + 6);
    state.gyro_bias = Eigen::Map<const Eigen::Vector3d>(x + 9);
    state.accel_bias = Eigen::Map<const Eigen::Vector3d>(x + 12);
    return state;
  }
  // Derivative of the step that retracts the state by the parameters.
  [[nodiscard]] Matrix15 step_by_parameters(const double* x) const {
    const Eigen::Vector3d phi = Eigen::Map<const Eigen::Vector3d>(x);
    Matrix15 D = Matrix15::Identity();
    D.block<3, 3>(0, 0) = so3_right_jacobian(phi);
    D.block<3, 3>(3, 3) = so3_exp(-phi);
    return D;
  }
  // Stores J, derivatives by the first columns of the step, as one by the parameters.
  void store(const Eigen::MatrixXd& J, const double* x, double* jacobian) const {
    if (jacobian != nullptr)
      Eigen::Map<RowMatrix>(jacobian, J.rows(), 15) = J * step_by_parameters(x).topRows(J.cols());
  }
};

// Blocks: frame, landmark.
class ReprojectionCost final : public ceres::SizedCostFunction<2, 15, 3> {
 public:
  ReprojectionCost(const ViewModel& view, const Eigen::Vector2d& bearing, const Chart& frame)
      : view_(view), bearing_(bearing), frame_(frame) {}

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const SE3 T = frame_.state(x[0]).T_odom_body;
    ReprojectionTerm term;
    if (!linearize_reprojection(view_, bearing_, T, frame_.held.pose.value_or(T),
                                Eigen::Map<const Eigen::Vector3d>(x[1]), term))
      return false;
    Eigen::Map<Eigen::Vector2d>{residuals} = term.r;
    if (jacobians == nullptr) return true;
    frame_.store(term.J_pose, x[0], jacobians[0]);
    if (jacobians[1] != nullptr) Eigen::Map<RowMatrix>(jacobians[1], 2, 3) = term.J_point;
    return true;
  }

 private:
  const ViewModel& view_;
  Eigen::Vector2d bearing_;
  const Chart& frame_;
};

// Blocks: frames i and j.
class ImuCost final : public ceres::SizedCostFunction<15, 15, 15> {
 public:
  ImuCost(const ImuFactor& factor, const Chart& i, const Chart& j)
      : factor_(factor), i_(i), j_(j) {}

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const OdometryState i = i_.state(x[0]), j = j_.state(x[1]);
    const ImuTerm term = factor_.linearize(i, j, i_.held.applied_to(i), j_.held.applied_to(j));
    Eigen::Map<Vector15>{residuals} = term.r;
    if (jacobians == nullptr) return true;
    i_.store(term.J_i, x[0], jacobians[0]);
    j_.store(term.J_j, x[1], jacobians[1]);
    return true;
  }

 private:
  const ImuFactor& factor_;
  const Chart& i_;
  const Chart& j_;
};

// Blocks: the frames of the prior. Its J is the derivative at every state: the first estimate.
class PriorCost final : public ceres::CostFunction {
 public:
  PriorCost(const StatePrior& prior, std::vector<const Chart*> frames)
      : prior_(prior), frames_(std::move(frames)) {
    set_num_residuals(static_cast<int>(prior.r.size()));
    mutable_parameter_block_sizes()->assign(frames_.size(), 15);
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    std::vector<OdometryState> states;
    for (std::size_t k = 0; k < frames_.size(); ++k) states.push_back(frames_[k]->state(x[k]));
    std::vector<const OdometryState*> pointers;
    for (const OdometryState& state : states) pointers.push_back(&state);
    Eigen::Map<Eigen::VectorXd>(residuals, prior_.r.size()) =
        prior_.J * prior_offset(prior_, pointers) + prior_.r;
    if (jacobians == nullptr) return true;
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      const Eigen::Index column = k == 0 ? 0 : 9 + 6 * static_cast<Eigen::Index>(k);
      frames_[k]->store(prior_.J.middleCols(column, k == 0 ? 15 : 6), x[k], jacobians[k]);
    }
    return true;
  }

 private:
  const StatePrior& prior_;
  std::vector<const Chart*> frames_;
};

// A window as parameter blocks. The costs refer to it and to the window.
class WindowProblem {
 public:
  explicit WindowProblem(const Window& window);

  void solve(const ceres::Solver::Options& options, ceres::Solver::Summary& summary) {
    ceres::Solve(options, &problem_, &summary);
  }
  [[nodiscard]] std::shared_ptr<ceres::ParameterBlockOrdering> ordering() {
    auto order = std::make_shared<ceres::ParameterBlockOrdering>();
    for (Eigen::Vector3d& point : points_)  // eliminated first
      if (problem_.HasParameterBlock(point.data())) order->AddElementToGroup(point.data(), 0);
    for (Vector15& state : states_) order->AddElementToGroup(state.data(), 1);
    return order;
  }
  void write_to(Window& window) const {
    for (std::size_t k = 0; k < states_.size(); ++k)
      window.frames[k].state = charts_[k].state(states_[k].data());
    for (std::size_t l = 0; l < points_.size(); ++l) window.landmarks[l].p_odom = points_[l];
  }

 private:
  void add_landmarks(const Window& window);

  std::vector<Chart> charts_;
  std::vector<Vector15> states_;
  std::vector<Eigen::Vector3d> points_;
  ceres::Problem problem_;
};

WindowProblem::WindowProblem(const Window& window) {
  const std::vector<FirstEstimate> held = first_estimates(window);
  for (std::size_t k = 0; k < window.frames.size(); ++k) {
    charts_.push_back({window.frames[k].state, held[k]});
    states_.push_back(charts_.back().parameters());
  }
  for (std::size_t k = 0; k < window.frames.size(); ++k) {
    problem_.AddParameterBlock(states_[k].data(), 15);
    if (k > 0 && window.frames[k].imu)
      problem_.AddResidualBlock(new ImuCost(*window.frames[k].imu, charts_[k - 1], charts_[k]),
                                nullptr, states_[k - 1].data(), states_[k].data());
  }
  add_landmarks(window);
  if (window.prior.frames.empty()) return;
  std::vector<const Chart*> charts;
  std::vector<double*> blocks;
  for (const std::uint64_t id : window.prior.frames) {
    const std::size_t k = frame_index(window, id);
    charts.push_back(&charts_[k]);
    blocks.push_back(states_[k].data());
  }
  problem_.AddResidualBlock(new PriorCost(window.prior, charts), nullptr, blocks);
}

void WindowProblem::add_landmarks(const Window& window) {
  for (const WindowLandmark& landmark : window.landmarks) points_.push_back(landmark.p_odom);
  for (std::size_t l = 0; l < points_.size(); ++l) {
    const WindowLandmark& landmark = window.landmarks[l];
    if (!landmark.located || landmark.observations.size() < 2) continue;
    for (const WindowObservation& o : landmark.observations)
      for (std::size_t c = 0; c < 2; ++c)
        if (o.bearings[c])
          problem_.AddResidualBlock(
              new ReprojectionCost(window.views[c], *o.bearings[c], charts_[o.frame]),
              new ceres::CauchyLoss(window.loss_scale), states_[o.frame].data(), points_[l].data());
  }
}

}  // namespace

WindowSolution optimize_by_ceres(Window& window, int max_iterations) {
  WindowProblem problem(window);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = problem.ordering();
  options.max_num_iterations = max_iterations;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  problem.solve(options, summary);
  const bool usable = summary.IsSolutionUsable();
  if (usable) problem.write_to(window);
  return {static_cast<int>(summary.iterations.size()) - 1, summary.initial_cost, summary.final_cost,
          usable};
}

}  // namespace km
