#pragma once

#include <string>

#include "apps/team/team_results.hpp"
#include "modules/core/json_writer.hpp"

namespace km {

/// The tables of a run for people: trajectories, closures and optimisation, traffic; then the notes
/// and the last words of robots that failed.
[[nodiscard]] std::string to_table(const TeamResult& team);

/// Writes the same as one JSON object: {robots: [{robot, name, exit_code, ...}], optimized: {...}}.
void write_json(JsonWriter& json, const TeamResult& team);

}  // namespace km
