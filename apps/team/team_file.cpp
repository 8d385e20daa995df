#include "apps/team/team_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <set>

#include "modules/evaluation/trajectory_file.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDatasetVariable = "${DATASET}";
constexpr std::uint32_t kMaxDomain = 230;  // of DDS, with its default ports

// Where values come from and problems go to.
struct Source {
  fs::path file;
  fs::path dataset;
  std::string unknown_keys = {}, problems = {};
  std::vector<std::string> notes = {};

  void problem(const YAML::Node& at, const std::string& text) { problems += line(at, text); }

  // Comes before all others, which it may be the cause of.
  void unknown(const YAML::Node& key, const std::set<std::string>& known) {
    unknown_keys += line(key, "unknown key " + key.Scalar() + suggestion(key.Scalar(), known));
  }

  fs::path path(const YAML::Node& at, std::string text) {
    const std::size_t variable = text.find(kDatasetVariable);
    if (variable != text.npos) {
      if (dataset.empty()) {
        problem(at, std::string(kDatasetVariable) + " needs --dataset");
        return {};
      }
      text.replace(variable, std::string(kDatasetVariable).size(), fs::absolute(dataset).string());
    }
    const fs::path absolute = fs::absolute(file).parent_path() / text;
    return absolute.lexically_normal();
  }

 private:
  [[nodiscard]] std::string line(const YAML::Node& at, const std::string& text) const {
    return file.string() + " line " + std::to_string(at.Mark().line + 1) + ": " + text + '\n';
  }
};

// The keys of one map; what is not asked for is a problem.
class Keys {
 public:
  Keys(Source& source, const YAML::Node& map) : source_(source), map_(map) {
    if (!map_.IsMap()) source_.problem(map_, "expected keys and values here");
  }

  // The value of `key` as T, if it is there.
  template <typename T>
  std::optional<T> get(const std::string& key, const char* expected) {
    const YAML::Node node = child(key);
    T value{};
    if (!node) return std::nullopt;
    if (YAML::convert<T>::decode(node, value)) return value;
    source_.problem(node, key + " is not " + expected);
    return std::nullopt;
  }

  // A path that must exist.
  fs::path existing_path(const std::string& key) {
    const auto text = get<std::string>(key, "a path");
    return text ? existing(map_[key], *text) : fs::path();
  }

  // The file of true poses; empty, with a note, if there is none: a run is worth having without.
  fs::path truth() {
    const auto text = get<std::string>("truth", "a path");
    if (!text) return {};
    const fs::path place = source_.path(map_["truth"], *text);
    const auto file = find_trajectory(place);
    if (!file && !place.empty())
      source_.notes.push_back("no true poses, so no errors: " + place.string() +
                              " is neither a file nor a folder with data.csv or "
                              "groundtruth_tum.txt");
    return file.value_or(fs::path());
  }

  std::vector<fs::path> existing_paths(const std::string& key) {
    std::vector<fs::path> paths;
    for (const auto& text : texts(key)) paths.push_back(existing(map_[key], text));
    return paths;
  }

  // A text or a list of texts.
  std::vector<std::string> texts(const std::string& key) {
    const YAML::Node node = child(key);
    if (!node) return {};
    if (node.IsScalar()) return {node.Scalar()};
    return get<std::vector<std::string>>(key, "a list of texts")
        .value_or(std::vector<std::string>{});
  }

  YAML::Node child(const std::string& key) {
    known_.insert(key);
    return map_.IsMap() ? map_[key] : YAML::Node(YAML::NodeType::Undefined);
  }

  void finish() {
    if (!map_.IsMap()) return;
    for (const auto& entry : map_)
      if (!known_.contains(entry.first.Scalar())) source_.unknown(entry.first, known_);
  }

 private:
  fs::path existing(const YAML::Node& at, const std::string& text) {
    fs::path path = source_.path(at, text);
    if (!path.empty() && !fs::exists(path))
      source_.problem(at, "no such file or folder: " + path.string());
    return path;
  }

  Source& source_;
  YAML::Node map_;
  std::set<std::string> known_;
};

bool is_folder_name(const std::string& name) {
  return !name.empty() && name.front() != '.' && name.size() <= 64 &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' ||
                  c == '.';
         });
}

RobotPlan read_robot(Source& source, const YAML::Node& node, const fs::path& team_truth) {
  Keys keys(source, node);
  RobotPlan robot;
  const auto id = keys.get<int>("id", "a number");
  if (!id || *id < 0 || *id > 65535)
    source.problem(node, "a robot needs an id from 0 to 65535");
  else
    robot.id = static_cast<RobotId>(*id);
  robot.name = keys.get<std::string>("name", "a text").value_or("robot" + std::to_string(robot.id));
  if (!is_folder_name(robot.name))
    source.problem(node, "name '" + robot.name + "' is not made of letters, digits, _, - and .");
  robot.dataset = keys.existing_path("dataset");
  robot.graph = keys.existing_path("graph");
  if (robot.dataset.empty() == robot.graph.empty())
    source.problem(node, "robot " + robot.name + " needs either dataset or graph");
  robot.from_s = keys.get<double>("from", "a number of seconds");
  robot.to_s = keys.get<double>("to", "a number of seconds");
  robot.truth = keys.truth();
  if (robot.truth.empty()) robot.truth = team_truth;
  robot.arguments = keys.texts("arguments");
  keys.finish();
  return robot;
}

void read_robots(Source& source, const YAML::Node& list, const fs::path& team_truth,
                 TeamPlan& plan) {
  std::set<RobotId> ids;
  std::set<std::string> names;
  for (const YAML::Node& node : list) {
    plan.robots.push_back(read_robot(source, node, team_truth));
    const RobotPlan& robot = plan.robots.back();
    if (!ids.insert(robot.id).second)
      source.problem(node, "id " + std::to_string(robot.id) + " is used twice");
    if (!names.insert(robot.name).second)
      source.problem(node, "name " + robot.name + " is used twice");
  }
}

// Numbers above zero; what is not given keeps its default.
ClosureTruthOptions read_closure_truth(Source& source, const YAML::Node& node) {
  ClosureTruthOptions options;
  if (!node) return options;
  Keys keys(source, node);
  const auto read = [&](const char* key, double max, double& value) {
    const auto number = keys.get<double>(key, "a number");
    if (number && !(*number > 0.0 && *number <= max))
      source.problem(keys.child(key), std::string(key) + " is not above 0 and at most " +
                                          std::to_string(std::lround(max)));
    else
      value = number.value_or(value);
  };
  read("max_translation_m", 1000.0, options.max_translation_m);
  read("max_rotation_deg", 180.0, options.max_rotation_deg);
  read("min_overlap", 1.0, options.min_overlap);
  read("default_depth_m", 1000.0, options.default_depth_m);
  keys.finish();
  return options;
}

YAML::Node load(const fs::path& file) {
  if (!fs::is_regular_file(file)) throw TeamFileError(file.string() + ": no such file");
  try {
    return YAML::LoadFile(file.string());
  } catch (const YAML::Exception& error) {
    throw TeamFileError(file.string() + " line " + std::to_string(error.mark.line + 1) + ": " +
                        error.msg);
  }
}

}  // namespace

bool is_rate(const std::string& text) {
  if (text == "max") return true;
  char* end = nullptr;
  const double rate = std::strtod(text.c_str(), &end);
  return end != text.c_str() && *end == '\0' && rate > 0.0;
}

TeamPlan read_team_file(const fs::path& file, const fs::path& dataset) {
  Source source{.file = file, .dataset = dataset};
  Keys keys(source, load(file));
  TeamPlan plan;
  plan.configs = keys.existing_paths("config");
  plan.rate = keys.get<std::string>("rate", "a number or max").value_or(plan.rate);
  if (!is_rate(plan.rate))
    source.problem(keys.child("rate"), "rate is neither a positive number nor max: " + plan.rate);
  plan.domain = keys.get<std::uint32_t>("domain", "a number");
  if (plan.domain && *plan.domain > kMaxDomain)
    source.problem(keys.child("domain"), "domain is not a number from 0 to 230");
  plan.output =
      keys.get<std::string>("output", "a path").value_or("results/" + file.stem().string());
  plan.time_limit_s = keys.get<double>("time_limit_s", "a number of seconds");
  const fs::path truth = keys.truth();
  plan.truth_mesh = keys.existing_path("truth_mesh");
  plan.closure_truth = read_closure_truth(source, keys.child("closure_truth"));
  const auto common = keys.texts("arguments");
  const YAML::Node robots = keys.child("robots");
  if (robots && robots.IsSequence() && robots.size() > 0)
    read_robots(source, robots, truth, plan);
  else
    source.problems += file.string() + ": a team needs a list of robots\n";
  keys.finish();
  if (const std::string all = source.unknown_keys + source.problems; !all.empty())
    throw TeamFileError(all);
  plan.notes = source.notes;
  for (RobotPlan& robot : plan.robots)
    robot.arguments.insert(robot.arguments.begin(), common.begin(), common.end());
  return plan;
}

}  // namespace km
