#include "apps/team/finished_run.hpp"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace km {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLastWords = 10;

// A file that is not a number counts as absent: it may be half written.
int exit_code(const fs::path& folder) {
  std::ifstream file(folder / "exit_code");
  int code = 0;
  if (file >> code) return code;
  return fs::is_regular_file(folder / "summary.json") ? 0 : 1;
}

std::deque<std::string> last_words(const fs::path& log) {
  std::deque<std::string> lines;
  std::ifstream file(log);
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
    if (lines.size() > kLastWords) lines.pop_front();
  }
  return lines;
}

}  // namespace

std::vector<RobotRun> finished_runs(const TeamPlan& plan) {
  if (!fs::is_directory(plan.output))
    throw std::runtime_error(plan.output.string() + ": no such folder");
  std::vector<RobotRun> runs;
  for (const RobotPlan& robot : plan.robots) {
    const fs::path folder = plan.output / robot.name;
    runs.push_back({{exit_code(folder), 0}, last_words(folder / "robot.log")});
  }
  return runs;
}

}  // namespace km
