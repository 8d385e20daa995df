#include "apps/experiments/report_input.hpp"

#include <cmath>
#include <sstream>

#include "apps/team/text_table.hpp"

namespace km {
namespace {

std::string machine_text(const StepRecord& record) {
  return record.machine.processor + ", " + std::to_string(record.machine.cores) + " cores, " +
         fixed(record.machine.memory_gb, 0) + " GB, load " + fixed(record.machine.load, 1) +
         "; commit " + record.commit;
}

ReportProvenance::Row row_of(const Step& step, const StepRecord* record) {
  if (record == nullptr)
    return {step.title, command_text(step.command),
            step.missing.empty() ? "not up to date, or not run" : "not run: " + step.missing, ""};
  if (record->command.empty())
    return {step.title, "found in " + step.outputs.front().string(), "made before, elsewhere", ""};
  return {step.title, command_text(record->command),
          record->started + ", " + fixed(record->seconds, 1) + " s", machine_text(*record)};
}

}  // namespace

ReportInput::ReportInput(const ExperimentConfig& config, const ExperimentPaths& paths)
    : config_(config), paths_(paths) {
  std::vector<std::string> names;
  for (const ExperimentName& experiment : kExperiments) names.emplace_back(experiment.name);
  for (const Step& step : plan_experiments(names, config, paths))
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

ReportProvenance ReportInput::provenance(const std::string& experiment) const {
  ReportProvenance provenance;
  for (const Step& step : plan_experiment(experiment, config_, paths_)) {
    const auto record = records_.find(step.name);
    provenance.rows.push_back(row_of(step, record == records_.end() ? nullptr : &record->second));
  }
  return provenance;
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
