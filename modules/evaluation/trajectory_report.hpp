#pragma once

#include <span>
#include <string>

#include "modules/charts/plot.hpp"
#include "modules/core/json.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// A table for people: one line per estimate, one for the team if there are several. Positions in
/// metres, angles in degrees, completeness in percent. Relative errors of which there are none are
/// "-", with a note below the table.
[[nodiscard]] std::string to_table(const TeamError& team);

/// The same numbers as one JSON object: {alignment: {scale, translation_m, rotation_xyzw},
/// robots: [{name, poses, pairs, position_m: {rmse, ...}, ...}], joint: {...}}. Statistics of
/// nothing have count 0 and null for the rest.
void to_json(Json& json, const TeamError& team);

/// The entry of one estimate alone.
void to_json(Json& json, const TrajectoryError& error);

/// A map: truth (grey) and the aligned estimates (one colour each) from above in the truth's world,
/// with each estimate's position rmse in its name. `team` is the result of trajectory_error() for
/// `inputs`. Truths that are one and the same are drawn once, over the time of their estimates.
[[nodiscard]] Plot plot_from_above(std::span<const TrajectoryInput> inputs, const TeamError& team);

}  // namespace km
