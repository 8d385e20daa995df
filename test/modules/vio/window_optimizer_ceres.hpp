#pragma once

#include "modules/vio/window_optimizer.hpp"

namespace km {

/// A second opinion on optimize(): the same cost, minimised by trust-region steps of Ceres with the
/// landmarks eliminated (DENSE_SCHUR). Not usable: Ceres failed, and the window is as it was.
WindowSolution optimize_by_ceres(Window& window, int max_iterations);

}  // namespace km
