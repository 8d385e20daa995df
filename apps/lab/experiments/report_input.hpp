#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/experiments/experiment_plan.hpp"
#include "apps/lab/experiments/report_document.hpp"
#include "apps/lab/experiments/step_record.hpp"
#include "apps/lab/experiments/world_results.hpp"

namespace km {

/// A target: a number to reach.
struct Target {
  std::string what;      ///< "ATE of odometry".
  std::string where;     ///< World or recording.
  std::string wanted;    ///< "at most 0.08 m".
  std::string measured;  ///< "0.029 m".
  bool met = false;
  bool full_size = false;  ///< Small versions of the experiments cannot decide it.
  bool judged = true;      ///< Set by ReportInput.
};

/// Input of the report: results that belong to the present configuration. Worlds and graphs are
/// read once.
class ReportInput {
 public:
  /// Searches for the results of all experiments.
  ReportInput(const ExperimentConfig& config, const ExperimentPaths& paths);

  [[nodiscard]] const ExperimentConfig& config() const { return config_; }
  [[nodiscard]] const ExperimentPaths& paths() const { return paths_; }

  /// True if the step's result exists and is up to date.
  [[nodiscard]] bool has(const std::string& step) const { return records_.contains(step); }

  /// Worlds among `names` with results of their team.
  struct World {
    const WorldConfig* config;
    const WorldResults* results;
  };
  [[nodiscard]] std::vector<World> worlds(const std::vector<std::string>& names);

  /// The world and its repetitions, as far as results exist.
  [[nodiscard]] std::vector<World> runs_of(const WorldConfig& world);

  /// The run of a world's team by the paper's pipeline; nullptr if there are no results.
  [[nodiscard]] const WorldResults* paper_run(const WorldConfig& world);

  /// nullptr if the method has no result.
  [[nodiscard]] const PgoNumbers* pgo(const WorldConfig& world, const PgoMethodConfig& method);
  /// Result of the method with that name; nullptr also if it is not configured.
  [[nodiscard]] const PgoNumbers* pgo(const WorldConfig& world, const std::string& method);

  /// The robot that ran alone; nullopt without results.
  [[nodiscard]] std::optional<RobotNumbers> alone() const;

  /// Origin of all results, and the reason for each missing one.
  [[nodiscard]] ReportProvenance provenance() const;

  void add_target(Target target);
  /// Targets that the sections added.
  [[nodiscard]] const std::vector<Target>& targets() const { return targets_; }

 private:
  std::vector<Target> targets_;
  const ExperimentConfig& config_;
  const ExperimentPaths& paths_;
  std::map<std::string, StepRecord> records_;
  std::map<std::string, WorldResults> worlds_;
  std::map<std::string, PgoNumbers> pgo_;
};

/// "0.113"; "-" for a missing value.
[[nodiscard]] std::string number_text(const std::optional<double>& value, int decimals);

/// `digits` significant digits, without exponent from 1e-5 to 1e6: "1316", "0.0538", "< 0.00001".
[[nodiscard]] std::string significant(double value, int digits = 3);

/// A value of the paper as printed there: "0.455", "168532", "97".
[[nodiscard]] std::string paper_text(double value);

/// A command as a person would type it, without the program's folder.
[[nodiscard]] std::string command_text(const std::vector<std::string>& command);

}  // namespace km
