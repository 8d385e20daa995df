#include "apps/team/team_file.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

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

// Options of kimera_multi_robot that name inputs.
constexpr std::array<std::string_view, 4> kInputOptions = {"--config", "--odometry", "--rig",
                                                           "--security"};

bool names_input(std::string_view option) {
  return std::ranges::find(kInputOptions, option) != kInputOptions.end();
}

// Makes the inputs in a list of arguments ("--rig", "rig.yaml" or "--rig=rig.yaml") independent of
// the working directory, and replaces ${DATASET}.
void resolve_arguments(YAML::Node arguments, const std::string& file,
                       const ConfigContext& context) {
  std::string option;
  for (std::size_t k = 0; arguments.IsSequence() && k < arguments.size(); ++k) {
    if (!arguments[k].IsScalar()) return;
    const std::string word = arguments[k].Scalar();
    const std::size_t equal = word.starts_with("--") ? word.find('=') : word.npos;
    if (equal != word.npos) option = word.substr(0, equal);
    std::string value = equal == word.npos ? word : word.substr(equal + 1);
    fs::path path;
    const std::string problem = names_input(option) ? resolve_input(value, context, Input{}, path)
                                                    : replace_dataset(value, context);
    if (!problem.empty())
      context.problems.others +=
          place_of(arguments[k], file) + ": arguments: " + word + ' ' + problem + '\n';
    if (names_input(option)) value = path.string();
    arguments[k] = equal == word.npos ? value : option + '=' + value;
    option = equal == word.npos ? word : "";
  }
}

void resolve_all_arguments(const YAML::Node& root, const std::string& file,
                           const ConfigContext& context) {
  if (!root.IsMap()) return;
  if (const YAML::Node arguments = root["arguments"]) resolve_arguments(arguments, file, context);
  const YAML::Node robots = root["robots"];
  if (!robots || !robots.IsSequence()) return;
  for (const YAML::Node& robot : robots)
    if (robot.IsMap() && robot["arguments"]) resolve_arguments(robot["arguments"], file, context);
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
  const YAML::Node root = load_yaml(file);
  resolve_all_arguments(root, file.string(), context);
  fill_config(read_section(root, "", file.string(), context), "", context, plan);
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
