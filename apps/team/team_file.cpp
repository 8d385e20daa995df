#include "apps/team/team_file.hpp"

#include <cstdlib>

#include "modules/evaluation/trajectory_file.hpp"
#include "runtime/config_text.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Finds the file of true poses. Empty, with a note, if there is none: a run is useful without it.
fs::path find_truth(const fs::path& place, std::vector<std::string>& notes) {
  if (place.empty()) return {};
  const auto file = find_trajectory(place);
  if (!file)
    notes.push_back("no true poses, so no errors: " + place.string() +
                    " is neither a file nor a folder with data.csv or groundtruth_tum.txt");
  return file.value_or(fs::path());
}

}  // namespace

bool is_rate(const std::string& text) {
  constexpr Bounds<double> kRate{1e-3, 1e6};  // bounds of --rate of kimera_multi_robot
  if (text == "max" || text == "auto") return true;
  char* end = nullptr;
  const double rate = std::strtod(text.c_str(), &end);
  return end != text.c_str() && *end == '\0' && kRate.contains(rate);
}

TeamPlan read_team_file(const fs::path& file, const fs::path& dataset) {
  ConfigProblems problems;
  const ConfigContext context{problems, fs::absolute(file).parent_path(), dataset};
  TeamPlan plan;
  fill_config(read_section(load_yaml(file), "", file.string(), context), "", context, plan);
  problems.finish();
  if (plan.output.empty()) plan.output = "results" / file.stem();
  plan.truth = find_truth(plan.truth, plan.notes);
  for (RobotPlan& robot : plan.robots) {
    robot.name = robot.name_or_default();
    robot.truth = find_truth(robot.truth, plan.notes);
    if (robot.truth.empty()) robot.truth = plan.truth;
    robot.arguments.insert(robot.arguments.begin(), plan.arguments.begin(), plan.arguments.end());
  }
  return plan;
}

std::string team_file_keys() {
  return keys_of(TeamPlan());
}

}  // namespace km
