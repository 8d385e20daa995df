#pragma once

#include <span>
#include <string>

#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// An SVG document: truth (grey) and the aligned estimates (one colour each) from above, x to the
/// right and y up in the truth's world, at one scale for both axes, with a scale bar and a legend
/// that gives each estimate's position rmse. `team` is the result of trajectory_error() for
/// `inputs`. Truths that are one and the same are drawn once, over the time of their estimates.
[[nodiscard]] std::string plot_from_above(std::span<const TrajectoryInput> inputs,
                                          const TeamError& team);

}  // namespace km
