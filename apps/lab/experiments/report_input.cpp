#include "apps/lab/experiments/report_input.hpp"

#include <cmath>
#include <set>
#include <sstream>

#include "modules/core/text_table.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

std::string machine_text(const Machine& machine) {
  return machine.processor + ", " + std::to_string(machine.cores) + " cores, " +
         fixed(machine.memory_gb, 0) + " GB";
}

// Folders that most commands name, with their names in the report.
using Folders = std::vector<std::pair<std::string, std::string>>;

Folders folders_of(const ExperimentPaths& paths) {
  Folders folders;
  for (const auto& [name, path] : {std::pair{"RESULTS", &paths.results},
                                   {"DATA", &paths.data},
                                   {"EUROC", &paths.euroc},
                                   {"GRAPHS", &paths.graphs}})
    if (!path->empty() && *path != fs::path(".")) folders.emplace_back(name, path->string());
  return folders;
}

std::string with_names(std::string text, const Folders& folders) {
  for (const auto& [name, folder] : folders)
    if (text.starts_with(folder + '/')) return name + text.substr(folder.size());
  return text;
}

ReportProvenance::Row row_of(const Step& step, const StepRecord& record, const Folders& folders) {
  if (record.command.empty())
    return {step.title, "found in " + with_names(step.outputs.front().string(), folders),
            "made before, elsewhere", ""};
  std::vector<std::string> command = record.command;
  for (std::string& word : command) word = with_names(word, folders);
  return {step.title, command_text(command),
          record.started + ", " + fixed(record.seconds, 1) + " s, load " +
              fixed(record.machine.load, 1),
          ""};
}

// Adds machine and commit of the rows' steps: common values once, the others with each row.
void add_machines(const std::vector<const StepRecord*>& records, ReportProvenance& provenance) {
  std::set<std::string> machines, commits;
  for (const StepRecord* record : records) {
    if (record->command.empty()) continue;  // made elsewhere
    machines.insert(machine_text(record->machine));
    commits.insert("commit " + record->commit);
  }
  const auto joined = [](const std::string& a, const std::string& b) {
    return a + (a.empty() || b.empty() ? "" : "; ") + b;
  };
  const auto common = [](const std::set<std::string>& texts) {
    return texts.size() == 1 ? *texts.begin() : std::string();
  };
  if (const std::string all = joined(common(machines), common(commits)); !all.empty())
    provenance.common = "All on " + all + '.';
  for (std::size_t k = 0; k < records.size(); ++k)
    if (!records[k]->command.empty())
      provenance.rows[k].machine =
          joined(machines.size() > 1 ? machine_text(records[k]->machine) : std::string(),
                 commits.size() > 1 ? "commit " + records[k]->commit : std::string());
}

std::vector<std::string> all_experiments() {
  std::vector<std::string> names;
  for (const ExperimentName& experiment : kExperiments) names.emplace_back(experiment.name);
  return names;
}

}  // namespace

ReportInput::ReportInput(const ExperimentConfig& config, const ExperimentPaths& paths)
    : config_(config), paths_(paths) {
  for (const Step& step : plan_experiments(all_experiments(), config, paths))
    if (state_of(step, paths.results) == StepState::kDone)
      records_[step.name] = *read_record(paths.results, step.name);
}

std::vector<ReportInput::World> ReportInput::worlds(const std::vector<std::string>& names) {
  std::vector<World> worlds;
  for (const std::string& name : names) {
    const WorldConfig& world = config_.world(name);
    if (!has("team-" + name)) continue;
    if (!worlds_.contains(name)) worlds_[name] = read_world_results(world, paths_);
    worlds.push_back({&world, &worlds_.at(name)});
  }
  return worlds;
}

const PgoNumbers* ReportInput::pgo(const WorldConfig& world, const PgoMethodConfig& method) {
  const std::string step = pgo_files(world, method, paths_).json.stem().string();
  if (!has(step) || !has("team-" + world.name)) return nullptr;
  if (!pgo_.contains(step)) pgo_[step] = read_pgo_numbers(world, method, paths_);
  return &pgo_.at(step);
}

std::vector<ReportInput::World> ReportInput::runs_of(const WorldConfig& world) {
  std::vector<std::string> names{world.name};
  const std::vector<std::string> others = config_.repetitions(world.name);
  names.insert(names.end(), others.begin(), others.end());
  return worlds(names);
}

const WorldResults* ReportInput::paper_run(const WorldConfig& world) {
  const WorldConfig* const run = config_.paper_run(world.name);
  const std::vector<World> found = run == nullptr ? std::vector<World>() : worlds({run->name});
  return found.empty() ? nullptr : found.front().results;
}

const PgoNumbers* ReportInput::pgo(const WorldConfig& world, const std::string& method) {
  for (const PgoMethodConfig& candidate : config_.methods)
    if (candidate.name == method) return pgo(world, candidate);
  return nullptr;
}

std::optional<RobotNumbers> ReportInput::alone() const {
  if (config_.alone.world.empty() || !has("alone-" + config_.alone.world)) return std::nullopt;
  RobotNumbers robot = read_lone_robot(alone_files(config_, paths_).run);
  robot.name = config_.alone.robot;
  return robot;
}

ReportProvenance ReportInput::provenance() const {
  ReportProvenance provenance;
  const Folders folders = folders_of(paths_);
  std::vector<const StepRecord*> records;
  std::map<std::string, std::string> open;  // reason: steps
  for (const Step& step : plan_experiments(all_experiments(), config_, paths_)) {
    const auto record = records_.find(step.name);
    if (record != records_.end()) {
      provenance.rows.push_back(row_of(step, record->second, folders));
      records.push_back(&record->second);
      continue;
    }
    std::string& names = open[step.missing.empty() ? "not run, or not up to date" : step.missing];
    names += (names.empty() ? "" : ", ") + step.name;
  }
  for (const auto& [why, names] : open)
    provenance.open.push_back("Not done: " + names + " (" + why + ").");
  add_machines(records, provenance);
  for (const auto& [name, folder] : folders)
    provenance.common += (provenance.common.empty() ? "" : " ") + name + ": " + folder + ".";
  return provenance;
}

void ReportInput::add_target(Target target) {
  target.judged = !(config_.quick && target.full_size);
  targets_.push_back(std::move(target));
}

std::string number_text(const std::optional<double>& value, int decimals) {
  return value ? fixed(*value, decimals) : "-";
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  const double magnitude = std::abs(value);
  if (magnitude < 1e-5) return magnitude < 1e-12 ? "0" : "< 0.00001";
  const int before = static_cast<int>(std::floor(std::log10(magnitude)));
  return fixed(value, std::max(0, digits - 1 - before));
}

std::string paper_text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string command_text(const std::vector<std::string>& command) {
  std::string text;
  for (std::size_t i = 0; i < command.size(); ++i) {
    const std::string word =
        i == 0 ? std::filesystem::path(command[0]).filename().string() : command[i];
    const bool plain = word.find_first_of(" '\"$*") == word.npos && !word.empty();
    text += (i == 0 ? "" : " ") + (plain ? word : '\'' + word + '\'');
  }
  return text;
}

}  // namespace km
