#pragma once

#include <filesystem>
#include <string>

#include "apps/team/team_results.hpp"
#include "modules/core/json.hpp"

namespace km {

/// The tables of a run for people: the runs, trajectories, closures and optimisation, closures
/// against the truth, traffic; then the notes and the last words of robots that failed: only these
/// if no robot left anything. At most 120 columns wide for names of up to 15 letters.
[[nodiscard]] std::string to_table(const TeamResult& team);

/// The same as one JSON object: {robots: [{robot, name, ... as in summary.json, exit_code,
/// exit_signal, odometry: {...}, in_team_frame, notes}], optimized: {...}, closures: {...}, meshes:
/// {...}, optimized_meshes: {...}, notes: [...]}; what could not be had is absent.
void to_json(Json& json, const TeamResult& team);

/// Throws std::runtime_error naming the file.
void write_json(const std::filesystem::path& file, const TeamResult& team);

}  // namespace km
