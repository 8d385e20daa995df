#include "apps/team/run_team.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>

#include "apps/result_files.hpp"
#include "modules/core/io/text_table.hpp"
#include "runtime/unblocked_output.hpp"

namespace km {
namespace {

int terminal_width() {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

}  // namespace

TeamDisplay::TeamDisplay(std::vector<std::string> names)
    : TeamDisplay(std::move(names), unblocked_stdout(), isatty(STDOUT_FILENO) == 1,
                  terminal_width()) {}

TeamDisplay::TeamDisplay(std::vector<std::string> names, std::ostream& output, bool terminal,
                         int width)
    : names_(std::move(names)),
      lines_(names_.size()),
      output_(output),
      terminal_(terminal),
      width_(static_cast<std::size_t>(std::max(width, 20))) {
  for (const std::string& name : names_) name_width_ = std::max(name_width_, name.size());
}

void TeamDisplay::update(std::size_t index, const std::string& line) {
  lines_[index] = line;
  if (terminal_) return redraw();
  output_ << names_[index] << std::string(name_width_ - names_[index].size(), ' ') << " | " << line
          << std::endl;
}

void TeamDisplay::redraw() {
  if (drawn_) output_ << "\x1b[" << names_.size() << 'A';
  drawn_ = true;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    std::string text =
        names_[i] + std::string(name_width_ - names_[i].size(), ' ') + " | " + lines_[i];
    output_ << "\r\x1b[K" << text.substr(0, width_ - 1) << '\n';
  }
  output_.flush();
}

namespace {

namespace fs = std::filesystem;

constexpr int kTeamPoll_ms = 100;
constexpr std::size_t kLastLines = 10;  // lines of a log

// Removes results of an earlier run, which --report would show. Robots on other hosts may have left
// them.
void remove_earlier_run(const TeamPlan& plan) {
  for (const RobotPlan& robot : plan.robots) {
    const auto folder = plan.output / robot.name;
    fs::create_directories(folder);
    remove_results(folder);
    fs::remove(folder / "exit_code");
  }
  for (const char* file : {kTeamMesh, kReportPage, kTeamRecord, kLinksTable, kLabelPalette})
    fs::remove(plan.output / file);
}

// Processes of a team, and the signals sent to them.
class RunningTeam {
 public:
  RunningTeam(const fs::path& binary, const TeamPlan& plan, SignalWatch& signals,
              TeamDisplay& display, EmulatedLinks* links)
      : signals_(signals), display_(display), links_(links) {
    remove_earlier_run(plan);
    for (const RobotPlan& robot : plan.robots) {
      std::function<bool()> enter_network;
      if (links != nullptr)
        enter_network = [&network = links->network(robots_.size())] { return network.enter(); };
      robots_.push_back(
          std::make_unique<RobotProcess>(robot_command(binary, plan, robot), signals.previous(),
                                         plan.output / robot.name / "robot.log", enter_network));
      display_.update(robots_.size() - 1, "started");
    }
  }

  // After a failure robots may still be running: all receive the request to end before the first is
  // waited for.
  ~RunningTeam() {
    for (const auto& robot : robots_) robot->ask_to_end();
  }
  RunningTeam(const RunningTeam&) = delete;
  RunningTeam& operator=(const RunningTeam&) = delete;

  void wait() {
    while (is_running()) {
      poll_output();
      for (std::size_t i = 0; i < robots_.size(); ++i) read(i);
      if (const auto signal = signals_.wait(0.0)) send_to_all(*signal);
    }
  }

  std::vector<RobotRun> results() const {
    std::vector<RobotRun> runs;
    for (const auto& robot : robots_)
      runs.push_back({robot->exit().value(), robot->last_log_lines()});
    return runs;
  }

 private:
  // Reason why a robot failed. It is shown at once, because the other robots may run for long.
  // Indented lines are details of the line above.
  static std::string why(const RobotProcess& robot) {
    const auto& words = robot.last_log_lines();
    const auto cause = std::find_if(words.rbegin(), words.rend(), [](const std::string& line) {
      return !line.empty() && line.front() != ' ';
    });
    return cause == words.rend() ? std::string() : ", " + *cause;
  }

  bool is_running() const {
    return std::any_of(robots_.begin(), robots_.end(),
                       [](const auto& robot) { return !robot->exit(); });
  }

  // Waits for output of any robot, at most kTeamPoll_ms.
  void poll_output() const {
    std::vector<pollfd> polled;
    for (const auto& robot : robots_)
      for (const int fd : robot->descriptors()) polled.push_back({fd, POLLIN, 0});
    poll(polled.data(), polled.size(), kTeamPoll_ms);
  }

  void read(std::size_t i) {
    if (robots_[i]->exit()) return;
    for (const std::string& line : robots_[i]->read()) {
      display_.update(i, line);
      const auto recorded_s = recorded_s_of(line);
      if (links_ != nullptr && recorded_s) links_->set_progress(i, *recorded_s);
    }
    if (robots_[i]->exit() && !robots_[i]->exit()->ok())
      display_.update(i, "FAILED: " + to_string(*robots_[i]->exit()) + why(*robots_[i]));
  }

  void send_to_all(int signal) {
    for (const auto& robot : robots_) robot->send(signal);
  }

  SignalWatch& signals_;
  TeamDisplay& display_;
  EmulatedLinks* const links_;  // may be null
  std::vector<std::unique_ptr<RobotProcess>> robots_;
};

// A file without a number counts as absent, because it may be half written.
int exit_code(const fs::path& folder) {
  std::ifstream file(folder / "exit_code");
  int code = 0;
  if (file >> code) return code;
  return fs::is_regular_file(folder / "summary.json") ? 0 : 1;
}

std::deque<std::string> last_log_lines(const fs::path& log) {
  std::deque<std::string> lines;
  std::ifstream file(log);
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
    if (lines.size() > kLastLines) lines.pop_front();
  }
  return lines;
}

}  // namespace

std::vector<std::string> robot_command(const fs::path& binary, const TeamPlan& plan,
                                       const RobotPlan& robot) {
  constexpr int kDigits = 12;
  std::vector<std::string> command = {binary.string()};
  const auto option = [&command](const char* name, const std::string& value) {
    command.emplace_back(name);
    command.push_back(value);
  };
  for (const auto& config : plan.configs) option("--config", config.string());
  option("--robot", std::to_string(robot.id));
  option("--name", robot.name);
  if (!plan.security.empty()) option("--security", (plan.security / robot.name).string());
  if (!robot.dataset.empty()) option("--dataset", robot.dataset.string());
  if (!robot.graph.empty()) option("--graph", robot.graph.string());
  if (robot.from_s) option("--from", rounded(*robot.from_s, kDigits));
  if (robot.to_s) option("--to", rounded(*robot.to_s, kDigits));
  option("--rate", plan.rate);
  option("--domain", std::to_string(plan.domain.value_or(0)));
  option("--output", (plan.output / robot.name).string());
  if (plan.record) command.emplace_back("--record");
  if (plan.view) command.emplace_back("--view");
  command.insert(command.end(), robot.arguments.begin(), robot.arguments.end());
  return command;
}

std::vector<RobotRun> run_team(const fs::path& binary, const TeamPlan& plan, SignalWatch& signals,
                               TeamDisplay& display, EmulatedLinks* links) {
  RunningTeam team(binary, plan, signals, display, links);
  team.wait();
  return team.results();
}

std::optional<double> recorded_s_of(const std::string& status_line) {
  const auto unit = status_line.find(" s, ");
  if (unit == std::string::npos) return std::nullopt;
  const std::string number = status_line.substr(0, unit);
  char* end = nullptr;
  const double s = std::strtod(number.c_str(), &end);
  return unit > 0 && end == number.c_str() + unit ? std::optional(s) : std::nullopt;
}

std::vector<RobotRun> finished_runs(const TeamPlan& plan) {
  if (!fs::is_directory(plan.output))
    throw std::runtime_error(plan.output.string() + ": no such folder");
  std::vector<RobotRun> runs;
  for (const RobotPlan& robot : plan.robots) {
    const fs::path folder = plan.output / robot.name;
    runs.push_back({{exit_code(folder), 0}, last_log_lines(folder / "robot.log")});
  }
  return runs;
}

}  // namespace km
