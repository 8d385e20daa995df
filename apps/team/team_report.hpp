#pragma once

#include <string>

#include "apps/team/team_results.hpp"
#include "modules/core/io/json.hpp"

namespace km {

/// The tables of a run for people: the runs, trajectories, closures and optimisation, closures
/// against the truth, traffic. Notes and the last log lines of failed robots follow; they are the
/// only content if no robot has results. At most 120 columns wide for names of up to 15 letters.
[[nodiscard]] std::string to_table(const TeamResult& team);

/// The tables as one JSON object: {robots: [{robot, name, ... as in summary.json, exit_code,
/// exit_signal, odometry: {...}, in_team_frame, notes}], optimized: {...}, closures: {...}, meshes:
/// {...}, optimized_meshes: {...}, notes: [...]}; missing results have no key.
void to_json(Json& json, const TeamResult& team);

}  // namespace km
