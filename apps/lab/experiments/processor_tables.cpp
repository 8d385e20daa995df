#include "apps/lab/experiments/processor_tables.hpp"

#include <algorithm>
#include <functional>

#include "modules/core/text_table.hpp"

namespace km {
namespace {

constexpr double kMostCores = 1.0, kMostCoresOfOdometry = 0.5;

std::optional<double> cores(const RobotNumbers& robot) {
  if (!robot.processor_s || !(robot.recorded_s > 0.0)) return std::nullopt;
  return *robot.processor_s / robot.recorded_s;
}

std::vector<ReportCell> processor_row(const std::string& name, const char* map,
                                      const RobotNumbers& robot) {
  return {{name},
          {map},
          {fixed(robot.recorded_s, 0)},
          {number_text(robot.processor_s, 1)},
          {number_text(cores(robot), 2)},
          {number_text(robot.peak_memory_mb, 0)}};
}

ReportTable processor_table(const std::vector<ReportInput::World>& worlds,
                            const std::optional<RobotNumbers>& alone) {
  ReportTable table{.caption = "Processor and memory of a robot",
                    .columns = {"robot", "with its map", "recording [s]", "CPU time [s]", "cores",
                                "peak memory [MB]"}};
  if (alone) table.rows.push_back(processor_row(alone->name + ", odometry alone", "no", *alone));
  for (const auto& [config, results] : worlds)
    for (const RobotNumbers& robot : results->robots)
      if (robot.processor_s || robot.peak_memory_mb)
        table.rows.push_back(
            processor_row(config->title + ", " + robot.name,
                          robot.module_s.contains("semantic_mapping") ? "yes" : "no", robot));
  table.note =
      "CPU time of the robot's process, user and system, all threads, from start to end; cores: "
      "that "
      "over the length of the recording, so what it takes at the recording's rate (20 images a "
      "second). Recordings are played as fast as they are taken (--rate max), which is the same "
      "work. Odometry alone: one robot without others and with mapping.mode=off; place recognition "
      "and optimisation over its own closures still run.";
  return table;
}

// Share of the module in the time of all modules' steps.
double share_percent(const RobotNumbers& robot, const std::string& module) {
  double all_s = 0.0;
  for (const auto& [other, seconds] : robot.module_s) all_s += seconds;
  const auto found = robot.module_s.find(module);
  return found == robot.module_s.end() || !(all_s > 0.0) ? 0.0 : 100.0 * found->second / all_s;
}

// Robots whose mean is shown in a column.
struct Profiled {
  std::string title;
  std::vector<std::reference_wrapper<const RobotNumbers>> robots;

  double mean_percent(const std::string& module) const {
    double sum = 0.0;
    for (const RobotNumbers& robot : robots) sum += share_percent(robot, module);
    return sum / static_cast<double>(std::max<std::size_t>(robots.size(), 1));
  }
};

// Modules whose steps take most of a robot's time, without those that only wait for others.
ReportTable profile_table(const std::vector<Profiled>& columns) {
  constexpr double kLeastModule_percent = 0.5;
  ReportTable table{.caption =
                        "Where the time goes: share of each module in that of all steps [%], "
                        "mean of the robots",
                    .columns = {"module"}};
  std::map<std::string, double> most;  // percentage in the column where it is largest
  for (const Profiled& column : columns) {
    table.columns.push_back(column.title);
    for (const RobotNumbers& robot : column.robots)
      for (const auto& [module, seconds] : robot.module_s)
        most[module] = std::max(most[module], column.mean_percent(module));
  }
  std::vector<std::pair<double, std::string>> modules;
  for (const auto& [module, percent] : most)
    if (percent >= kLeastModule_percent) modules.emplace_back(-percent, module);
  std::sort(modules.begin(), modules.end());
  for (const auto& [percent, module] : modules) {
    std::vector<ReportCell> row{{module}};
    for (const Profiled& column : columns) row.push_back({fixed(column.mean_percent(module), 1)});
    table.rows.push_back(std::move(row));
  }
  table.note =
      "By the clock on the wall: a step also waits for a core, those of the map the longest, which "
      "give way to odometry.";
  return table;
}

void add_targets(ReportInput& input, const std::vector<ReportInput::World>& worlds,
                 const std::optional<RobotNumbers>& alone) {
  const auto add = [&](const char* what, const std::string& where, const RobotNumbers& robot,
                       double most, const char* wanted) {
    if (const auto taken = cores(robot))
      input.add_target({what, where, wanted, fixed(*taken, 2) + " cores", *taken <= most, true});
  };
  if (alone)
    add("processor of odometry alone, 20 Hz", alone->name, *alone, kMostCoresOfOdometry,
        "at most 0.5 cores");
  for (const auto& [config, results] : worlds)
    for (const RobotNumbers& robot : results->robots)
      add("processor of a whole robot", config->title + ", " + robot.name, robot, kMostCores,
          "at most 1 core");
}

}  // namespace

void add_processor_tables(ReportInput& input, const std::vector<ReportInput::World>& worlds,
                          const std::optional<RobotNumbers>& alone, ReportSection& section) {
  if (ReportTable table = processor_table(worlds, alone); !table.rows.empty())
    section.blocks.emplace_back(std::move(table));
  std::vector<Profiled> columns;
  if (alone) columns.push_back({alone->name + " alone", {*alone}});
  for (const auto& [config, results] : worlds)
    columns.push_back({config->title, {results->robots.begin(), results->robots.end()}});
  if (ReportTable table = profile_table(columns); !table.rows.empty())
    section.blocks.emplace_back(std::move(table));
  add_targets(input, worlds, alone);
}

}  // namespace km
