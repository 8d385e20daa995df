#pragma once

#include <span>
#include <string>

#include "modules/charts/plot.hpp"
#include "modules/core/json.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// A table for people with one line per estimate, and one for the team if there are several.
/// Positions are in metres, angles in degrees, completeness in percent. Missing relative errors are
/// "-", with a note below the table.
[[nodiscard]] std::string to_table(const TeamError& team);

/// The errors as one JSON object: {alignment: {scale, translation_m, rotation_xyzw}, robots:
/// [{name, poses, pairs, position_m: {rmse, ...}, ...}], joint: {...}}. Statistics of an empty
/// sample have count 0 and null for the rest.
void to_json(Json& json, const TeamError& team);

/// The JSON object of one estimate.
void to_json(Json& json, const TrajectoryError& error);

/// A map: truth (grey) and the aligned estimates (one colour each) from above in the truth's world.
/// The name of each estimate includes its position rmse. `team` is the result of trajectory_error()
/// for `inputs`. Identical truths are drawn once, over the time of their estimates.
[[nodiscard]] Plot plot_from_above(std::span<const TrajectoryInput> inputs, const TeamError& team);

}  // namespace km
