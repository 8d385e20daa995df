#pragma once

#include <deque>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/team/emulated_links.hpp"
#include "apps/team/robot_process.hpp"
#include "apps/team/team_display.hpp"
#include "apps/team/team_file.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// What became of the frames between the robots, in the team's output folder.
inline constexpr const char* kLinksTable = "links.csv";

/// The records of all robots, likewise.
inline constexpr const char* kTeamRecord = "team.mcap";

/// The report of the run, likewise.
inline constexpr const char* kReportPage = "report.html";

/// How one robot's process ended.
struct RobotRun {
  ProcessExit exit;
  std::deque<std::string> last_words;
};

/// The robot's command line.
[[nodiscard]] std::vector<std::string> robot_command(const std::filesystem::path& binary,
                                                     const TeamPlan& plan, const RobotPlan& robot);

/// Starts a process per robot and waits for all of them; in the order of the plan, whose domain is
/// set. With `links`, each is in its network there, by its number in the plan. Signals are passed
/// on to the robots: the first asks them to end in order, as does the time limit, the second ends
/// them at once. 30 s after the time limit they are killed. Output folders are made, and results of
/// an earlier run in them removed. Throws std::runtime_error if a process cannot be started; none
/// is left then.
[[nodiscard]] std::vector<RobotRun> run_team(const std::filesystem::path& binary,
                                             const TeamPlan& plan, SignalWatch& signals,
                                             TeamDisplay& display,
                                             const EmulatedLinks* links = nullptr);

/// How the robots of a run fared that has ended elsewhere, on other hosts or in containers, from
/// the folders they left below `plan.output`; in the order of the plan. The exit code is that in
/// the file `exit_code`, if whoever ran the robot wrote one; else 0 for a robot that left its
/// summary.json, and 1 for one that did not. The last words are the last lines of `robot.log`.
[[nodiscard]] std::vector<RobotRun> finished_runs(const TeamPlan& plan);

}  // namespace km
