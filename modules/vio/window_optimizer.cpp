#include "modules/vio/window_optimizer.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

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

}  // namespace km
