#pragma once

#include <vector>

#include "apps/team/run_team.hpp"
#include "apps/team/team_file.hpp"

namespace km {

/// How the robots of a run fared that has ended elsewhere, on other hosts or in containers, from
/// the folders they left below `plan.output`; in the order of the plan. The exit code is that in
/// the file `exit_code`, if whoever ran the robot wrote one; else 0 for a robot that left its
/// summary.json, and 1 for one that did not. The last words are the last lines of `robot.log`.
[[nodiscard]] std::vector<RobotRun> finished_runs(const TeamPlan& plan);

}  // namespace km
