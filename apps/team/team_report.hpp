#pragma once

#include <string>

#include "apps/team/team_results.hpp"
#include "modules/core/json_writer.hpp"

namespace km {

/// The tables of a run for people: the runs, trajectories, closures and optimisation, closures
/// against the truth, traffic; then the notes and the last words of robots that failed: only these
/// if no robot left anything. At most 120 columns wide for names of up to 15 letters.
[[nodiscard]] std::string to_table(const TeamResult& team);

/// Writes the same as one JSON object: {robots: [{robot, name, exit_code, ...}], optimized: {...},
/// closures: {...}, meshes: {...}, optimized_meshes: {...}, notes: [...]}; what could not be had is
/// absent.
void write_json(JsonWriter& json, const TeamResult& team);

}  // namespace km
