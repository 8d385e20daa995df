#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/output_file.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/sensors/node/open_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kKeyframes = "keyframes.csv", kClosures = "loop_closures.csv";

// Keyframes and closures of the robots of one results folder, or of one record.
struct Found {
  std::vector<KeyframeRecord> keyframes;
  std::vector<ClosureRecord> closures;
};

void append(auto& to, const auto& more) {
  to.insert(to.end(), more.begin(), more.end());
}

Found found_in(const fs::path& results) {
  if (results.extension() != ".mcap")
    return {read_keyframes(results / kKeyframes), read_closures(results / kClosures)};
  Found all;
  for (const auto& [name, text] : read_mcap_attachments(results)) {
    const std::string place = results.string() + ':' + name;
    if (name.ends_with(kKeyframes)) append(all.keyframes, parse_keyframes(text, place));
    if (name.ends_with(kClosures)) append(all.closures, parse_closures(text, place));
  }
  if (all.keyframes.empty())
    throw std::invalid_argument(results.string() +
                                ": no keyframes.csv in it, which a robot adds at " +
                                "the end of its run: give the folder of its results");
  return all;
}

// Time span of a robot's keyframes, and its inputs.
struct RobotSpan {
  RobotId robot = 0;
  Stamp first = 0, last = 0;
  std::size_t keyframes = 0, placed = 0;
  fs::path results, truth;
};

std::vector<RobotSpan> spans_of(const std::vector<KeyframeRecord>& keyframes,
                                const std::vector<TrueKeyframe>& placed, const fs::path& results,
                                const fs::path& truth) {
  std::map<RobotId, RobotSpan> spans;
  for (const KeyframeRecord& keyframe : keyframes) {
    auto& span = spans
                     .try_emplace(keyframe.id.robot, RobotSpan{.robot = keyframe.id.robot,
                                                               .first = keyframe.stamp,
                                                               .results = results,
                                                               .truth = truth})
                     .first->second;
    span.first = std::min(span.first, keyframe.stamp);
    span.last = std::max(span.last, keyframe.stamp);
    ++span.keyframes;
  }
  for (const TrueKeyframe& keyframe : placed) ++spans.at(keyframe.id.robot).placed;
  std::vector<RobotSpan> all;
  for (const auto& [robot, span] : spans) all.push_back(span);
  return all;
}

// Reasons why the numbers may be useless: the true poses belong to another robot, or to none.
std::string notes_on(const std::vector<RobotSpan>& spans) {
  const auto name = [](const RobotSpan& span) {
    return "robot " + std::to_string(span.robot) + " (" + span.results.string() + ')';
  };
  const std::string way_out =
      "give one --truth for each of --results, in their order: its robot's own true poses\n";
  std::string notes;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const RobotSpan& a = spans[i];
    if (a.placed == 0)
      notes += "note: none of the " + std::to_string(a.keyframes) + " keyframes of " + name(a) +
               " lies within " + a.truth.string() + ": " + way_out;
    for (std::size_t j = i + 1; j < spans.size(); ++j) {
      const RobotSpan& b = spans[j];
      if (a.truth == b.truth && a.robot != b.robot && a.first <= b.last && b.first <= a.last)
        notes += "note: " + a.truth.string() + " is taken for the true poses of " + name(a) +
                 " and of " + name(b) + " at the same times. Unless both are parts of one " +
                 "recording, " + way_out;
    }
  }
  return notes;
}

struct ClosuresCommand {
  std::vector<fs::path> truths, results;
  fs::path dataset, json;

  void define(CLI::App& app) {
    app.add_option("--truth", truths,
                   "True poses in one common world: one file for each of --results, or one for "
                   "all, where they are parts of one recording")
        ->required();
    app.add_option(
           "--results", results,
           "Results folders of all robots of the run, or records (MCAP) of robots or of the team")
        ->required();
    app.add_option("--dataset", dataset, "EuRoC/ASL folder: its left camera is the robots'")
        ->required();
    app.add_option("--json", json, "Also write the numbers to this file, as JSON");
  }

  void run() const {
    check_output_folder(json);
    const auto true_poses = read_truths(truths, results.size(), "--results");
    std::vector<TrueKeyframe> keyframes;
    std::vector<ClosureRecord> closures;
    std::vector<RobotSpan> spans;
    for (std::size_t i = 0; i < results.size(); ++i) {
      const Found found = found_in(results[i]);
      const auto placed = place_keyframes(found.keyframes, of_each(true_poses, i));
      append(spans, spans_of(found.keyframes, placed, results[i], of_each(truths, i)));
      append(keyframes, placed);
      append(closures, found.closures);
    }
    const SensorRig rig = read_euroc_rig(find_mav0(dataset));
    const ClosureScores scores = score_closures(keyframes, closures, rig.stereo.cameras[0]);
    std::cout << to_table(scores) << notes_on(spans);
    write_json_output(json, scores);
  }
};

constexpr const char* kClosuresDetails =
    R"(Loop closures of a finished run against the truth, per stage: their number, the share
of true ones (precision), and the share of the possible ones that was found (recall)

A candidate is true if both keyframes see the same place: 30 % of either's image, at the median
depth that the keyframe sees, lies in the other's. A verified closure and an inlier are false if
the measured pose errs by more than 0.5 m or 5 degrees and by more than its covariance explains
(99.9 %).
Recall counts pairs of keyframes of two robots that see the same place, and, as a system needs
only one match per keyframe, keyframes that are part of such a pair.

One --truth is that of robots on parts of one recording; else each robot needs its own, in the
order of --results.

Examples:
  kimera_multi_evaluate closures --dataset MH_01_easy --truth groundtruth_tum.txt \
      --results results/two/a results/two/b
  kimera_multi_evaluate closures --dataset room/robot0 \
      --truth room/robot{0,1}/mav0/state_groundtruth_estimate0/data.csv \
      --results results/robot{0,1})";

}  // namespace

void add_closures(CLI::App& app) {
  add_command<ClosuresCommand>(app, "closures", kClosuresDetails);
}

}  // namespace km
