#include "apps/robot/run_findings.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "modules/core/geometry.hpp"
#include "modules/core/text_table.hpp"
#include "modules/diagnosis/figure_text.hpp"

namespace km {
namespace {

using Names = std::map<RobotId, std::string>;
using Tallies = std::map<std::pair<RobotId, RobotId>, ClosureTally>;

std::string name_of(const Names& names, RobotId robot) {
  const auto found = names.find(robot);
  return found != names.end() && !found->second.empty() ? found->second
                                                        : "robot " + std::to_string(robot);
}

// The most common reason, as text: "matches do not agree on a pose" (300 of 412).
std::string commonest(const std::map<std::string, std::uint64_t>& reasons, std::uint64_t of) {
  const auto most = std::ranges::max_element(reasons, {}, [](const auto& r) { return r.second; });
  return '"' + most->first + "\" (" + std::to_string(most->second) + " of " + std::to_string(of) +
         ')';
}

// Finding that closures did not join two robots, with the reason and its consequence. The caller
// adds the names of the robots in front.
Finding not_joined(const ClosureTally& tally, const PcmConfig& pcm, bool has_one_vocabulary,
                   bool was_lost) {
  Finding finding{.id = "team.not_joined", .severity = Severity::kWarning};
  std::string outcome = " did not join: ";
  const std::string candidates = std::to_string(tally.candidates) + " candidates, ";
  const std::string verified =
      candidates + std::to_string(tally.verified) + " verified (see loop_closures.csv), ";
  if (tally.candidates == 0 && !has_one_vocabulary) {
    finding.what = "0 candidates: their keyframes are described by different vocabularies";
    finding.means = "none of them can be compared";
    finding.to_do = "the same run.vocabulary on all robots";
  } else if (tally.candidates == 0) {
    finding.what = "0 candidates: no place of one looks like a place of the other";
    finding.means =
        "they were at different places, or the vocabulary does not distinguish these places";
    finding.to_do = "let both see one place from about the same side";
  } else if (tally.received == 0) {
    finding.what = candidates + "of which no keyframe came for verification";
    finding.means = "place recognition works, but the link or its budget did not carry keyframes";
    finding.to_do = "see held_back in summary.json and dds in config.yaml, or run longer";
  } else if (tally.verified == 0) {
    finding.what = candidates + std::to_string(tally.received) +
                   " compared, 0 verified (see loop_closures.csv)";
    if (!tally.unmatched.empty())
      finding.what += ", most of them: " + commonest(tally.unmatched, tally.received);
    finding.means = "places look alike but are not the same, or are seen from too far apart";
    finding.to_do = "let both see one place from about the same side, or check stereo calibration";
  } else if (tally.rejected > 0 && tally.inliers == 0) {
    finding.what = verified + std::to_string(tally.rejected) + " rejected by the optimiser, 0 kept";
    finding.means = "closures contradict each other: of places that look alike, or by odometry";
    finding.to_do = "check odometry of both, or pose_graph.barc";
  } else if (pcm.selection == ClosureSelection::kPcm &&
             tally.inliers < static_cast<std::uint64_t>(pcm.min_inliers)) {
    finding.what = verified + std::to_string(tally.inliers) + " kept: below pcm.min_inliers " +
                   std::to_string(pcm.min_inliers);
    finding.means = "too few closures agree to trust them";
    finding.to_do = "meet for longer, or lower pcm.min_inliers where places do not look alike";
  } else if (tally.inliers == 0) {
    finding.what = verified + "0 kept: no pcm.min_witnesses " + std::to_string(pcm.min_witnesses) +
                   " that agree at different places";
    finding.means = "too few closures agree to trust them";
    finding.to_do = "meet at a second place, or run longer than pcm.witness_wait_s";
  } else if (was_lost) {
    outcome = " are not in one frame in the end: ";
    finding.what = verified + std::to_string(tally.inliers) +
                   " kept, but one was not received any more when the other ended";
    finding.means = "what joined them, if they were joined before, ended with it";
    finding.to_do =
        "see its log; if it was killed, --resume continues it; out of reach, bring it back";
  } else if (tally.verified >= 2 * tally.inliers) {
    finding.what = verified + std::to_string(tally.inliers) + " kept, which the others contradict";
    finding.means = "places look alike, so that closures agree on more than one relative pose";
    finding.to_do = "let both see a place that looks like no other one";
  } else {
    finding.what = verified + std::to_string(tally.inliers) + " kept: enough";
    finding.means = "the run ended, or the link, before their pose graphs were one";
    finding.to_do = "let the robots stay within reach after their input has ended (--serve-limit)";
  }
  finding.what = outcome + finding.what;
  return finding;
}

// Tallies by robot pair, over the closures that either robot found.
Tallies tallies_of(std::span<const RunFacts> runs) {
  Tallies tallies;
  for (const RunFacts& run : runs)
    for (const auto& [other, tally] : run.closures)
      tallies[std::minmax(run.summary.robot, other)] += tally;
  return tallies;
}

void add_apart(std::span<const RunFacts> runs, const Names& names, std::vector<Finding>& findings) {
  const Tallies tallies = tallies_of(runs);
  std::set<std::pair<RobotId, RobotId>> reported;
  for (const RunFacts& run : runs) {
    const RobotId self = run.summary.robot;
    const OptimizerSummary& pgo = run.summary.pgo;
    const auto is_joined = [&](RobotId robot) {
      return std::ranges::find(pgo.members, robot) != pgo.members.end() &&
             std::ranges::find(pgo.not_joined, robot) == pgo.not_joined.end();
    };
    for (const auto& [other, name] : names) {
      if (other == self || is_joined(other)) continue;
      const auto pair = std::minmax(self, other);
      if (!reported.insert(pair).second) continue;
      const auto tally = tallies.find(pair);
      Finding finding = not_joined(tally == tallies.end() ? ClosureTally{} : tally->second, run.pcm,
                                   !run.summary.other_vocabulary.contains(name),
                                   run.summary.lost_peers.contains(name));
      finding.what =
          name_of(names, pair.first) + " and " + name_of(names, pair.second) + finding.what;
      findings.push_back(std::move(finding));
    }
  }
}

void add_tentative(std::span<const RunFacts> runs, const Names& names,
                   std::vector<Finding>& findings) {
  std::set<std::pair<RobotId, RobotId>> reported;
  for (const RunFacts& run : runs)
    for (const RobotId other : run.summary.pgo.tentative) {
      const auto pair = std::minmax(run.summary.robot, other);
      if (!reported.insert(pair).second) continue;
      findings.push_back(
          {.id = "team.tentative",
           .severity = Severity::kWarning,
           .what = name_of(names, pair.first) + " and " + name_of(names, pair.second) +
                   " are in one frame tentatively: closures at a single place tie them",
           .means = "if that place only looks like another, their relative place is wrong",
           .to_do = "let them meet at a second place"});
    }
}

void add_localization(const RunSummary& run, std::vector<Finding>& findings) {
  if (!run.localization || run.localization->localised) return;
  findings.push_back(
      {.id = "localization.not",
       .severity = Severity::kWarning,
       .what = run.name + ": not localised in " + run.localization->map + ": " +
               std::to_string(run.localization->matched) + " of " +
               std::to_string(run.localization->compared) + " keyframes match it",
       .means = "the poses in optimized.tum are those of odometry, not in the frame of the map",
       .to_do = "let the robot see two places of the map from where the former run saw them"});
}

void add_unseen(const RunSummary& run, std::vector<Finding>& findings) {
  if (run.frames + run.frames_skipped + run.keyframes > 0) return;
  findings.push_back({.id = "frames.none",
                      .severity = Severity::kError,
                      .what = run.name + ": 0 frames, 0 keyframes",
                      .means = "odometry never began: nothing of this robot is in the results",
                      .to_do = "see sensor_faults in summary.json; of live topics "
                               "kimera_multi_doctor --live RIG shows which is silent"});
}

void add_skipped(const RunSummary& run, std::vector<Finding>& findings) {
  if (run.frames_skipped == 0) return;
  const auto skipped = static_cast<double>(run.frames_skipped);
  const double share = skipped / (skipped + static_cast<double>(run.frames));
  constexpr double kFew = 0.01;
  findings.push_back({.id = "frames.skipped",
                      .severity = share < kFew ? Severity::kNote : Severity::kWarning,
                      .what = run.name + ": " + std::to_string(run.frames_skipped) +
                              " frames skipped, " + percent(share),
                      .means = "processors were short: odometry got fewer images, evenly spread",
                      .to_do = "--rate auto, which waits, a lower tracker.max_features or "
                               "vio.window_keyframes, or a faster computer"});
}

void add_paused(const RunSummary& run, std::vector<Finding>& findings) {
  if (run.paused_s < kNoticedPause_s) return;
  const bool used_all = run.frames_skipped == 0;
  findings.push_back(
      {.id = "frames.paused",
       .severity = Severity::kNote,
       .what = run.name + ": its recording was paused for " + fixed(run.paused_s, 1) + " s in all",
       .means = used_all ? "processors were short, and the recording waited for them: every image "
                           "was used, and a live robot would have left images out"
                         : "processors were short: with every image that odometry could do "
                           "without left out, the recording still came too fast",
       .to_do = used_all ? "nothing for a recording; for a live robot fewer programs on its "
                           "computer, or a faster one"
                         : "--rate auto, which waits, fewer robots or programs on this computer; a "
                           "live robot would have dropped images here"});
}

void add_map_gave_way(const RunSummary& run, std::vector<Finding>& findings) {
  if (!run.mapping || run.mapping->dropped_under_load == 0) return;
  const auto left_out = static_cast<double>(run.mapping->dropped_under_load);
  const double share = left_out / (left_out + static_cast<double>(run.mapping->frames));
  constexpr double kFew = 0.05;
  findings.push_back({.id = "map.dropped_under_load",
                      .severity = share < kFew ? Severity::kNote : Severity::kWarning,
                      .what = run.name + ": " + std::to_string(run.mapping->dropped_under_load) +
                              " frames were left out of the map, " + percent(share),
                      .means = "processors were short, and the map gives way to odometry: it may "
                               "have holes",
                      .to_do = "--rate auto, which waits, a lower mapping.rate_hz, a higher "
                               "stereo_depth.downscale, or a faster computer"});
}

void add_noisy_odometry(const RunSummary& run, std::vector<Finding>& findings) {
  const OptimizerSummary& pgo = run.pgo;
  constexpr double kNoisy = 2.0;
  if (std::max(pgo.odometry_rotation_noise, pgo.odometry_translation_noise) < kNoisy) return;
  findings.push_back(
      {.id = "odometry.noisy",
       .severity = Severity::kWarning,
       .what = run.name + ": its odometry is " + fixed(pgo.odometry_rotation_noise, 1) +
               " times noisier in rotation and " + fixed(pgo.odometry_translation_noise, 1) +
               " times in translation than it claims",
       .means = "loop closures inside the robot contradict its odometry by that "
                "much: the pose graph weighs it accordingly",
       .to_do = "kimera_multi_doctor on the recording looks at calibration and "
                "stamps; vio.drift_rotation and vio.drift_translation are what "
                "odometry claims"});
}

void add_broken_odometry(const RunSummary& run, std::vector<Finding>& findings) {
  if (run.pgo.odometry_breaks == 0) return;
  findings.push_back({.id = "odometry.broken",
                      .severity = Severity::kWarning,
                      .what = run.name + ": " + std::to_string(run.pgo.odometry_breaks) +
                              " steps of its odometry are wrong",
                      .means =
                          "loop closures inside the robot agree on a jump there, as after lost "
                          "tracking; the optimised trajectory is corrected, odometry.tum is not",
                      .to_do = "see the log for the keyframes, and odometry in summary.json"});
}

void add_images_alone(const RunSummary& run, std::vector<Finding>& findings) {
  if (!run.odometry || run.odometry->inertial_sensor) return;
  findings.push_back({.id = "odometry.images_alone",
                      .severity = Severity::kNote,
                      .what = run.name + ": odometry by images alone, without an inertial sensor",
                      .means = "gravity is unknown: z of poses and maps is the upward direction of "
                               "the camera at the first image, not the vertical (map.yaml needs a "
                               "level camera there), and no pose is "
                               "known while vision is lost for more than a second",
                      .to_do = ""});
}

// There are more samples and messages than frames. A share of the frames keeps their faults
// visible.
void add_sensor_faults(const RunSummary& run, std::vector<Finding>& findings) {
  constexpr double kFew = 0.01;
  const double most = kFew * static_cast<double>(run.frames);
  if (run.frames == 0 || std::ranges::none_of(run.sensor_faults, [most](const auto& fault) {
        return static_cast<double>(fault.second) > most;
      }))
    return;
  std::string faults;
  for (const auto& [fault, count] : run.sensor_faults)
    faults += (faults.empty() ? "" : ", ") + std::to_string(count) + ' ' + fault;
  findings.push_back(
      {.id = "sensors.faults",
       .severity = Severity::kWarning,
       .what = run.name + ": " + faults + "; " + std::to_string(run.frames) + " frames were whole",
       .means = "what is concerned was left out: odometry, or the map, had less to go by",
       .to_do = "kimera_multi_doctor on the recording, or --live on the topics, "
                "names the first of each"});
}

void add_holes(const RunSummary& run, std::vector<Finding>& findings) {
  if (!run.holes) return;
  const HolesSummary& holes = *run.holes;
  std::string what = run.name + ": no pose for " + fixed(holes.longest_s, 1) + " s, from " +
                     fixed(holes.longest_from_s, 1) + " s on";
  if (holes.count > 1)
    what += ", the longest of " + std::to_string(holes.count) + " holes of " +
            fixed(holes.seconds, 1) + " s in all";
  findings.push_back({.id = "trajectory.hole",
                      .severity = Severity::kWarning,
                      .what = what,
                      .means = "how it went there is not known: charts leave the line out, and "
                               "the poses behind it are known less well",
                      .to_do = run.frames_skipped > 0
                                   ? "frames were skipped: --rate auto, which waits, or fewer "
                                     "robots on this computer"
                                   : "see sensor_faults in summary.json for images that are "
                                     "missing, and the log for when odometry started again"});
}

void add_rejected(const RunFacts& run, std::vector<Finding>& findings) {
  ClosureTally all;
  for (const auto& [other, tally] : run.closures) all += tally;
  if (all.rejected == 0) return;
  const double share = static_cast<double>(all.rejected) / static_cast<double>(all.verified);
  constexpr double kMany = 0.3;
  findings.push_back(
      {.id = "closures.rejected",
       .severity = share < kMany ? Severity::kNote : Severity::kWarning,
       .what = run.summary.name + ": " + std::to_string(all.rejected) + " of " +
               std::to_string(all.verified) + " verified closures were rejected by the optimiser",
       .means = "other measurements contradict them: places that look alike, or odometry "
                "worse than its covariances state",
       .to_do = share < kMany ? "" : "check odometry; see loop_closures.csv"});
}

void add_cameras(const RunSummary& run, std::vector<Finding>& findings) {
  if (!run.cameras) return;
  const CamerasSummary& found = *run.cameras;
  constexpr double kSure = 3.0;  // standard deviations
  constexpr double kOffset_s = 2e-3, kLargeOffset_s = 1e-2, kRotation_rad = 8.7e-3;
  constexpr double kReadout_s = 3e-3;
  if (std::abs(found.offset_s) > std::max(kOffset_s, kSure * found.offset_sigma_s))
    findings.push_back({.id = "cameras.offset",
                        .severity = std::abs(found.offset_s) < kLargeOffset_s ? Severity::kNote
                                                                              : Severity::kWarning,
                        .what = run.name + ": stamps of images are " +
                                fixed(1e3 * found.offset_s, 1) + " ms (+- " +
                                fixed(1e3 * found.offset_sigma_s, 1) +
                                ") off those of the inertial sensor",
                        .means = "it was estimated and made good, but for the start of the run",
                        .to_do = "camera_time_offset_s in the rig file"});
  if (found.readout_s > std::max(kReadout_s, kSure * found.readout_sigma_s))
    findings.push_back({.id = "cameras.rolling",
                        .severity = Severity::kNote,
                        .what = run.name + ": the rows of an image are exposed over " +
                                fixed(1e3 * found.readout_s, 1) + " ms (+- " +
                                fixed(1e3 * found.readout_sigma_s, 1) +
                                ") more than tracker.readout_s states",
                        .means = "a rolling shutter; odometry has estimated and corrected it, but "
                                 "for the start of the run",
                        .to_do = "if the readout time is known, state it in tracker.readout_s and "
                                 "lower vio.calibration_readout_s"});
  const double rotation_rad =
      Eigen::Vector3d(found.rotation_x_rad, found.rotation_y_rad, found.rotation_z_rad).norm();
  if (rotation_rad > std::max(kRotation_rad, kSure * found.rotation_sigma_rad))
    findings.push_back({.id = "cameras.turned",
                        .severity = Severity::kWarning,
                        .what = run.name + ": the cameras are turned by " +
                                fixed(kDegrees * rotation_rad, 2) + " degrees (+- " +
                                fixed(kDegrees * found.rotation_sigma_rad, 2) +
                                ") against their calibration",
                        .means = "it was estimated and made good, but not for the map",
                        .to_do = "calibrate cameras and inertial sensor again"});
}

void add_lost(const RunSummary& run, std::vector<Finding>& findings) {
  for (const auto& [name, seconds] : run.lost_peers)
    findings.push_back({.id = "link.lost",
                        .severity = Severity::kWarning,
                        .what = run.name + ": " + name + " had not been received for " +
                                fixed(seconds, 1) + " s at the end",
                        .means = "it went out of reach or died: its last closures are missing",
                        .to_do = "see its log; kimera_multi_doctor --network examines the link"});
}

void add_vocabularies(const RunSummary& run, std::vector<Finding>& findings) {
  for (const auto& [name, keyframes] : run.other_vocabulary)
    findings.push_back({.id = "vocabulary.other",
                        .severity = Severity::kError,
                        .what = run.name + ": " + std::to_string(keyframes) + " keyframes of " +
                                name + " are described by another vocabulary",
                        .means = "none of them can be compared: these robots never join",
                        .to_do = "the same run.vocabulary on all robots"});
}

void add_networks(const RunSummary& run, std::vector<Finding>& findings) {
  for (const auto& [name, keyframes] : run.other_network)
    findings.push_back({.id = "network.other",
                        .severity = Severity::kWarning,
                        .what = run.name + ": " + std::to_string(keyframes) + " keyframes of " +
                                name + " were matched by ORB",
                        .means = "their keypoints are described by another network, or by none: "
                                 "fewer closures are found",
                        .to_do = "the same keyframe_features.network on all robots"});
}

void add_budget(const RunSummary& run, std::vector<Finding>& findings) {
  if (!run.held_back) return;
  const auto sum = [](const std::map<std::string, std::uint64_t>& by_category) {
    std::uint64_t total = 0;
    for (const auto& [category, count] : by_category) total += count;
    return total;
  };
  const std::uint64_t delayed = sum(run.held_back->delayed.messages);
  const std::uint64_t dropped = sum(run.held_back->dropped.messages);
  if (delayed + dropped == 0) return;
  findings.push_back(
      {.id = "budget.held_back",
       .severity = dropped == 0 ? Severity::kNote : Severity::kWarning,
       .what = run.name + ": the budget delayed " + std::to_string(delayed) + " messages (" +
               bytes_text(static_cast<double>(sum(run.held_back->delayed.bytes))) +
               ") and dropped " + std::to_string(dropped) + " (" +
               bytes_text(static_cast<double>(sum(run.held_back->dropped.bytes))) + ')',
       .means = dropped == 0 ? "the other robots received them later"
                             : "the other robots never received them",
       .to_do = dropped == 0 ? "" : "raise budget.bytes_per_s or budget.bytes_per_run"});
}

void add_memory(const RunSummary& run, std::vector<Finding>& findings) {
  const double growth = run.process.memory_growth_bytes_per_minute.value_or(0.0);
  constexpr double kMuch = 20e6;
  if (growth > kMuch)
    findings.push_back(
        {.id = "memory.grows",
         .severity = Severity::kWarning,
         .what = run.name + ": memory grows by " + bytes_text(growth) + " a minute, " +
                 bytes_text(static_cast<double>(run.process.peak_memory_bytes)) + " at most so far",
         .means = "a longer run may not fit",
         .to_do = "semantic_mapping.max_blocks and window_m, or a map without "
                  "labels (mapping.mode)"});
}

void add_map(const RunSummary& run, std::vector<Finding>& findings) {
  if (!run.mapping) return;
  if (run.mapping->blocks_refused > 0)
    findings.push_back({.id = "map.full",
                        .severity = Severity::kWarning,
                        .what = run.name + ": " + std::to_string(run.mapping->blocks_refused) +
                                " blocks did not fit into the map",
                        .means = "the mesh has holes where they would be",
                        .to_do = "raise semantic_mapping.max_blocks"});
  const std::uint64_t skipped = run.mapping->skipped_too_late;
  if (skipped > run.mapping->frames)
    findings.push_back({.id = "map.frames_late",
                        .severity = Severity::kWarning,
                        .what = run.name + ": " + std::to_string(skipped) +
                                " frames came too late for the map, " +
                                std::to_string(run.mapping->frames) + " are in it",
                        .means = "the map is sparser than mapping.rate_hz requests",
                        .to_do = "a lower mapping.rate_hz"});
}

}  // namespace

void ClosureTally::add(ClosureStage stage, const std::string& reason) {
  ++candidates;
  received += stage >= ClosureStage::kReceived ? 1 : 0;
  verified += stage >= ClosureStage::kVerified ? 1 : 0;
  inliers += stage == ClosureStage::kInlier ? 1 : 0;
  rejected += stage == ClosureStage::kVerified && reason == kRejectedByOptimiser ? 1 : 0;
  if (stage == ClosureStage::kReceived) ++unmatched[reason];
}

ClosureTally& ClosureTally::operator+=(const ClosureTally& other) {
  candidates += other.candidates;
  received += other.received;
  verified += other.verified;
  inliers += other.inliers;
  rejected += other.rejected;
  for (const auto& [reason, count] : other.unmatched) unmatched[reason] += count;
  return *this;
}

std::vector<Finding> findings_of(std::span<const RunFacts> runs) {
  Names names;
  for (const RunFacts& run : runs) names.insert(run.names.begin(), run.names.end());
  for (const RunFacts& run : runs) names[run.summary.robot] = run.summary.name;
  std::vector<Finding> findings;
  add_apart(runs, names, findings);
  add_tentative(runs, names, findings);
  for (const RunFacts& run : runs) {
    add_vocabularies(run.summary, findings);
    add_networks(run.summary, findings);
    add_lost(run.summary, findings);
    add_unseen(run.summary, findings);
    add_localization(run.summary, findings);
    add_skipped(run.summary, findings);
    add_paused(run.summary, findings);
    add_map_gave_way(run.summary, findings);
    add_noisy_odometry(run.summary, findings);
    add_broken_odometry(run.summary, findings);
    add_images_alone(run.summary, findings);
    add_sensor_faults(run.summary, findings);
    add_holes(run.summary, findings);
    add_rejected(run, findings);
    add_cameras(run.summary, findings);
    add_budget(run.summary, findings);
    add_memory(run.summary, findings);
    add_map(run.summary, findings);
  }
  sort_by_severity(findings);
  return findings;
}

Finding failed_run(const std::string& reason) {
  return {.id = kFailedRun,
          .severity = Severity::kError,
          .what = reason,
          .means = "the results are incomplete or of no use",
          .to_do = "see the log of the robot, and the exit codes in apps/robot/README.md"};
}

}  // namespace km
