#include "apps/doctor/examine_results.hpp"

#include <algorithm>
#include <vector>

#include "apps/result_files.hpp"
#include "apps/robot/robot_config.hpp"
#include "apps/robot/run_findings.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/closure_truth.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

Finding unfinished_run(const fs::path& folder) {
  return {.id = "run.unfinished",
          .severity = Severity::kWarning,
          .what = unfinished(folder),
          .means =
              "trajectory, closures and map are not written yet; run.journal holds them up to the "
              "last second",
          .to_do = way_on(folder)};
}

// Note on a missing or invalid file, which need not be a fault of the run.
Finding missing(const char* file, const std::string& why) {
  return {.id = std::string("results.") + file,
          .severity = Severity::kNote,
          .what = why,
          .means = "this file is not examined"};
}

std::map<RobotId, ClosureTally> tallies_in(const fs::path& folder, RobotId self) {
  std::map<RobotId, ClosureTally> tallies;
  for (const ClosureRecord& closure : read_closures(folder / "loop_closures.csv"))
    tallies[closure.id.from.robot == self ? closure.id.to.robot : closure.id.from.robot].add(
        closure.stage, closure.reason);
  return tallies;
}

RunFacts facts_in(const fs::path& folder, std::vector<Finding>& findings) {
  RunFacts facts{
      .summary = read_summary(folder / kSummary), .closures = {}, .names = {}, .pcm = {}};
  try {
    facts.closures = tallies_in(folder, facts.summary.robot);
  } catch (const InputFileError& error) {
    findings.push_back(missing("loop_closures", error.what()));
  }
  try {
    RobotOptions options;
    options.configs = {folder / "config.yaml"};
    facts.pcm = load_robot_config(options).pcm;
  } catch (const ConfigError& error) {
    findings.push_back(missing("config", error.what()));
  }
  for (const auto& [robot, tally] : facts.closures)
    if (robot != facts.summary.robot) facts.names.emplace(robot, "");
  return facts;
}

std::vector<Figure> figures_of(const RunFacts& facts) {
  ClosureTally all;
  for (const auto& [robot, tally] : facts.closures) all += tally;
  const RunSummary& run = facts.summary;
  return {{run.name, std::to_string(run.frames) + " frames, " + std::to_string(run.keyframes) +
                         " keyframes, closures " + std::to_string(all.candidates) + " > " +
                         std::to_string(all.verified) + " > " + std::to_string(all.inliers) +
                         ", in one frame with " +
                         std::to_string(run.pgo.members.empty() ? 0 : run.pgo.members.size() - 1) +
                         ", " + fixed(run.seconds, 1) + " s: " + run.exit_reason}};
}

}  // namespace

bool are_results(const fs::path& folder) {
  return is_folder(folder) && !robot_folders(folder).empty();
}

Examination examine_results(const fs::path& folder) {
  Examination result;
  std::vector<RunFacts> runs;
  for (const fs::path& robot : robot_folders(folder)) {
    if (!is_file(robot / kSummary)) {
      result.findings.push_back(unfinished_run(robot));
      continue;
    }
    runs.push_back(facts_in(robot, result.findings));
    for (const Figure& figure : figures_of(runs.back())) result.figures.push_back(figure);
    for (const Finding& finding : runs.back().summary.findings)
      if (finding.id == kFailedRun) result.findings.push_back(finding);
  }
  // The findings in the summary of a single robot include the links to other robots.
  const bool is_alone = runs.size() == 1 && !runs.front().summary.findings.empty();
  const std::vector<Finding> found = is_alone ? runs.front().summary.findings : findings_of(runs);
  for (const Finding& finding : found)
    if (!is_alone || finding.id != kFailedRun) result.findings.push_back(finding);
  sort_by_severity(result.findings);
  return result;
}

}  // namespace km
