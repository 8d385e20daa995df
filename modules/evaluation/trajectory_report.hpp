#pragma once

#include <string>

#include "modules/core/json_writer.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// A table for people: one line per estimate, one for the team if there are several. Positions in
/// metres, angles in degrees, completeness in percent. Relative errors of which there are none are
/// "-", with a note below the table.
[[nodiscard]] std::string to_table(const TeamError& team);

/// Writes the same numbers as one JSON object: {alignment: {scale, translation_m, rotation_xyzw},
/// robots: [{name, poses, pairs, position_m: {rmse, ...}, ...}], joint: {...}}. Statistics of
/// nothing have count 0 and null for the rest.
void write_json(JsonWriter& json, const TeamError& team);

/// The entry of one estimate alone.
void write_json(JsonWriter& json, const TrajectoryError& error);

}  // namespace km
