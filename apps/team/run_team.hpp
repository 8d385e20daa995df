#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "apps/team/emulated_links.hpp"
#include "apps/team/robot_process.hpp"
#include "apps/team/team_file.hpp"
#include "runtime/signal_watch.hpp"

namespace km {

/// Table of the frames between the robots, in the team's output folder.
inline constexpr const char* kLinksTable = "links.csv";

/// Merged records of all robots, in the team's output folder.
inline constexpr const char* kTeamRecord = "team.mcap";

/// Report of the run, in the team's output folder.
inline constexpr const char* kReportPage = "report.html";

/// One line per robot, redrawn in place on a terminal. Otherwise prints every line with the robot's
/// name in front.
class TeamDisplay {
 public:
  /// Prints to unblocked_stdout(); isatty() decides whether it is a terminal.
  explicit TeamDisplay(std::vector<std::string> names);
  /// For tests: `output` outlives this. `width` [characters] cuts lines on a terminal.
  TeamDisplay(std::vector<std::string> names, std::ostream& output, bool terminal, int width);

  /// The newest line of robot `index`.
  void update(std::size_t index, const std::string& line);

 private:
  void redraw();

  std::vector<std::string> names_;
  std::vector<std::string> lines_;
  std::ostream& output_;
  bool terminal_;
  std::size_t width_;
  std::size_t name_width_ = 0;
  bool drawn_ = false;
};

/// Exit status of the process of one robot.
struct RobotRun {
  ProcessExit exit;
  std::deque<std::string> last_log_lines;
};

/// The command line of a robot.
[[nodiscard]] std::vector<std::string> robot_command(const std::filesystem::path& binary,
                                                     const TeamPlan& plan, const RobotPlan& robot);

/// Starts one process per robot and waits for all of them. Returns their ends in the order of
/// `plan`, whose domain must be set. With `links`, each robot runs in the network that has its
/// index in the plan. Signals are passed to the robots: the first asks them to end in order, the
/// second ends them at once. Makes the output folders and removes earlier results from them. Throws
/// std::runtime_error if a process cannot be started; no process is left then.
[[nodiscard]] std::vector<RobotRun> run_team(const std::filesystem::path& binary,
                                             const TeamPlan& plan, SignalWatch& signals,
                                             TeamDisplay& display, EmulatedLinks* links = nullptr);

/// Time since the start of the recording in a status line of a robot [s]: the number with which the
/// line begins ("7.4 s, 148 images"). nullopt for another line.
[[nodiscard]] std::optional<double> recorded_s_of(const std::string& status_line);

/// Ends of the robots of a run that has ended elsewhere, on other hosts or in containers, from
/// their folders below `plan.output`; in the order of the plan. The exit code is the content of the
/// file `exit_code`, if there is one. Otherwise it is 0 for a robot with a summary.json, and 1
/// without. `last_log_lines` are those of `robot.log`.
[[nodiscard]] std::vector<RobotRun> finished_runs(const TeamPlan& plan);

}  // namespace km
