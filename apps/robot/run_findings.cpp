#include "apps/robot/run_findings.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/sensors/stream_stamps.hpp"

namespace km {
namespace {

using Names = std::map<RobotId, std::string>;
using Tallies = std::map<std::pair<RobotId, RobotId>, ClosureTally>;

constexpr const char* kSameVocabulary = "use one run.vocabulary on all robots";

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

// Advice to two robots without a common place.
constexpr const char* kMeetElsewhere = "let both robots see one place from about the same side";

// Finding that closures did not join two robots: the first stage that stopped them. The caller adds
// the names of the robots in front.
Finding not_joined(const ClosureTally& tally, const PcmConfig& pcm, bool has_one_vocabulary,
                   bool was_lost) {
  const std::string candidates = std::to_string(tally.candidates) + " candidates, ";
  const std::string verified =
      candidates + std::to_string(tally.verified) + " verified (see loop_closures.csv), ";
  const std::string kept = verified + std::to_string(tally.inliers) + " kept";
  const auto finding = [](const std::string& what, const char* means, const char* to_do) {
    return Finding{.id = "team.not_joined",
                   .severity = Severity::kWarning,
                   .what = " did not join: " + what,
                   .means = means,
                   .to_do = to_do};
  };
  if (tally.candidates == 0 && !has_one_vocabulary)
    return finding("0 candidates: their keyframes have different vocabularies",
                   "keyframes with different vocabularies cannot be compared", kSameVocabulary);
  if (tally.candidates == 0)
    return finding("0 candidates: no place of one robot looks like a place of the other",
                   "the robots were at different places, or the vocabulary does not distinguish "
                   "these places",
                   kMeetElsewhere);
  if (tally.received == 0)
    return finding(candidates + "no keyframe was received for verification",
                   "place recognition works, but the link or its budget did not carry keyframes",
                   "see held_back in summary.json and dds in config.yaml, or run longer");
  if (tally.verified == 0)
    return finding(
        candidates + std::to_string(tally.received) +
            " compared, 0 verified (see loop_closures.csv)" +
            (tally.unmatched.empty()
                 ? ""
                 : "; most common reason: " + commonest(tally.unmatched, tally.received)),
        "the places look alike but are different, or were seen from positions too far apart",
        "let both robots see one place from about the same side, or check the stereo calibration");
  if (tally.rejected > 0 && tally.inliers == 0)
    return finding(verified + std::to_string(tally.rejected) + " rejected by the optimiser, 0 kept",
                   "the closures contradict each other or odometry, for example because places "
                   "look alike",
                   "check the odometry of both robots, or pose_graph.barc");
  if (pcm.selection == ClosureSelection::kPcm &&
      tally.inliers < static_cast<std::uint64_t>(pcm.min_inliers))
    return finding(kept + ": below pcm.min_inliers " + std::to_string(pcm.min_inliers),
                   "too few closures agree",
                   "meet for longer, or lower pcm.min_inliers where places do not look alike");
  if (tally.inliers == 0)
    return finding(kept + ": no pcm.min_witnesses " + std::to_string(pcm.min_witnesses) +
                       " closures at different places agree",
                   "too few closures agree",
                   "meet at a second place, or run longer than pcm.witness_wait_s");
  if (was_lost) {
    Finding lost = finding("", "one robot ended while the other one was out of reach or had ended",
                           "see the log of the lost robot; --resume continues a killed robot");
    lost.what = " are in different frames at the end: " + kept +
                ", but one robot was not received when the other one ended";
    return lost;
  }
  if (tally.verified >= 2 * tally.inliers)
    return finding(kept + ", which the other closures contradict",
                   "places look alike, so that closures agree on more than one relative pose",
                   "let both robots see a place that looks like no other place");
  return finding(kept + ": enough",
                 "the run or the link ended before the robots had optimised together",
                 "keep the robots within reach after their input has ended (--serve-limit)");
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
    const OptimizerProgress& pgo = run.summary.pgo;
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
           .what =
               name_of(names, pair.first) + " and " + name_of(names, pair.second) +
               " are joined tentatively: all their closures are along one stretch of their paths",
           .means = "if this place only looks like another one, their relative pose "
                    "is wrong",
           .to_do = "let them meet at another place, too"});
    }
}

// Adds the findings on one run.
class FindingsOfRun {
 public:
  FindingsOfRun(const RunFacts& facts, std::vector<Finding>& findings)
      : facts_(facts), run_(facts.summary), findings_(findings) {
    for (Finding finding : run_.noticed) {
      finding.what = run_.name + ": " + finding.what;
      findings_.push_back(std::move(finding));
    }
    add_team();
    add_input();
    add_odometry();
    add_cameras();
    add_resources();
    add_map();
  }

 private:
  static constexpr auto kNote = Severity::kNote, kWarning = Severity::kWarning,
                        kError = Severity::kError;

  // `id` is stable, for programs.
  void add(Severity severity, const char* id, const std::string& what, const char* means,
           const char* to_do) {
    findings_.push_back({.id = id,
                         .severity = severity,
                         .what = run_.name + ": " + what,
                         .means = means,
                         .to_do = to_do});
  }

  void add_team() {
    for (const auto& [name, keyframes] : run_.other_vocabulary)
      add(kError, "vocabulary.other",
          std::to_string(keyframes) + " keyframes of " + name + " have another vocabulary",
          "none of them can be compared: these robots never join", kSameVocabulary);
    for (const auto& [name, keyframes] : run_.other_network)
      add(kWarning, "network.other",
          std::to_string(keyframes) + " keyframes of " + name + " were matched by ORB",
          "their keypoints are described by another network or by none: fewer closures are found",
          "use one keyframe_features.network on all robots");
    if (run_.forged_announcements > 0)
      add(kWarning, "network.forged",
          "the announcements of " + std::to_string(run_.forged_announcements) +
              " robots were forged",
          "a program in the network sends packets in the name of robots: they meet late or never",
          "find the program; in a team without keys it can also send measurements (--security)");
    for (const auto& [name, why] : run_.unmet_peers)
      add(kWarning, "network.unmet", (name + " was never met: ").append(why),
          "its messages were not used",
          why.find("keys") != why.npos ? "give all robots keys of one team: kimera_multi_keys"
                                       : "kimera_multi_doctor --network examines the network");
    for (const auto& [name, seconds] : run_.lost_peers)
      add(kWarning, "link.lost",
          name + " was not received in the last " + fixed(seconds, 1) + " s of the run",
          "that robot was out of reach or had died: its last closures are missing",
          "see its log; kimera_multi_doctor --network examines the link");
    if (run_.localization && !run_.localization->localised)
      add(kWarning, "localization.not",
          "not localised in " + run_.localization->map + ": " +
              std::to_string(run_.localization->matched) + " of " +
              std::to_string(run_.localization->compared) + " keyframes match it",
          "the poses in optimized.tum are those of odometry, not of the map's frame",
          "let the robot see two places of the map from where the former run saw them");
    ClosureTally all;
    for (const auto& [other, tally] : facts_.closures) all += tally;
    constexpr double kMany = 0.3;
    if (all.rejected > 0) {
      const bool are_many =
          static_cast<double>(all.rejected) >= kMany * static_cast<double>(all.verified);
      add(are_many ? kWarning : kNote, "closures.rejected",
          "the optimiser rejected " + std::to_string(all.rejected) + " of " +
              std::to_string(all.verified) + " verified closures",
          "other measurements contradict them: places look alike, or odometry is worse than its "
          "covariances",
          "check odometry; see loop_closures.csv");
      if (!are_many) findings_.back().to_do.clear();
    }
  }

  void add_input() {
    const auto complete = static_cast<double>(run_.frames + run_.frames_skipped);
    if (run_.frames + run_.frames_skipped + run_.keyframes == 0)
      add(kError, "frames.none", "0 frames, 0 keyframes",
          "odometry did not start: the results have nothing of this robot",
          "see sensor_faults in summary.json; for live topics kimera_multi_doctor --live RIG names "
          "the silent one");
    constexpr double kFew = 0.01;
    if (run_.frames_skipped > 0) {
      const double share = static_cast<double>(run_.frames_skipped) / complete;
      add(share < kFew ? kNote : kWarning, "frames.skipped",
          std::to_string(run_.frames_skipped) + " frames skipped, " + percent(share),
          "the processors were too slow: images were left out of odometry at even intervals",
          "for a recording --rate auto, which waits; a lower tracker.max_features or "
          "vio.window_keyframes, or "
          "a faster computer");
    }
    const bool all_used = run_.frames_skipped == 0;
    if (run_.paused_s >= kNoticedPause_s)
      add(kNote, "frames.paused",
          "the recording was paused for " + fixed(run_.paused_s, 1) + " s in all",
          all_used ? "the processors were too slow, and the recording waited: every image was "
                     "used, but a live robot would have left images out"
                   : "the processors were too slow, also without the images that odometry can do "
                     "without",
          all_used
              ? "nothing for a recording; for a live robot run fewer programs on its computer, or "
                "use a faster one"
              : "use --rate auto, which waits, or run fewer robots or programs on this computer");
    // There are more samples and messages than frames. A share of the frames keeps their faults
    // visible.
    const auto is_frequent = [&](const auto& fault) {
      return static_cast<double>(fault.second) > kFew * complete;
    };
    if (run_.frames == 0 || std::ranges::none_of(run_.sensor_faults, is_frequent)) return;
    std::string faults;
    for (const auto& [fault, count] : run_.sensor_faults)
      faults += (faults.empty() ? "" : ", ") + std::to_string(count) + ' ' + fault;
    add(kWarning, "sensors.faults", faults + "; " + fixed(complete, 0) + " complete frames",
        "odometry and map do not use the affected data",
        "kimera_multi_doctor on the recording, or --live on the topics, names the first fault of "
        "each kind");
  }

  void add_odometry() {
    constexpr double kNoisy = 2.0;
    const double rotation = run_.pgo.odometry_rotation_noise,
                 translation = run_.pgo.odometry_translation_noise;
    // The 99.9999 % quantile of chi-squared with 6 degrees of freedom, as for closures.
    constexpr double kContradicting = 38.3 / 6.0;
    const bool is_near = run_.correction && !(run_.correction->normalised_square > kContradicting);
    if (std::max(rotation, translation) >= kNoisy)
      add(is_near ? kNote : kWarning, "odometry.noisy",
          "the noise of odometry is " + fixed(rotation, 1) + " times the stated one in rotation, " +
              fixed(translation, 1) + " times in translation",
          is_near ? "the pose graph uses the larger noise; the optimised trajectory agrees with "
                    "odometry"
                  : "loop closures of this robot contradict its odometry to this extent: the pose "
                    "graph uses the larger noise",
          "check calibration and stamps with kimera_multi_doctor on the recording; "
          "vio.drift_rotation and vio.drift_translation are the stated noise");
    if (run_.pgo.odometry_breaks > 0)
      add(kWarning, "odometry.broken",
          std::to_string(run_.pgo.odometry_breaks) + " steps of odometry are wrong",
          "loop closures of this robot agree on a jump there, as after lost tracking; the "
          "optimised trajectory is corrected, odometry.tum is not",
          "see the log for the keyframes, and odometry in summary.json");
    if (run_.correction && !is_near)
      add(kWarning, "odometry.contradicted",
          "the optimised trajectory is up to " + fixed(run_.correction->largest_m, 2) +
              " m from odometry, " + fixed(std::sqrt(run_.correction->normalised_square), 1) +
              " times the stated standard deviation of odometry",
          "either odometry is worse than it states, or false closures bend the trajectory",
          "compare odometry.tum and optimized.tum, and see loop_closures.csv for the closures");
    if (run_.odometry && !run_.odometry->has_imu)
      add(kNote, "odometry.images_alone", "odometry by images alone, without an inertial sensor",
          "z of poses and maps is the upward direction of the camera at the first image, not the "
          "vertical (map.yaml needs a level camera there); no pose is known while vision is lost "
          "for more than a second",
          "");
    if (run_.odometry && run_.odometry->vision_losses > 0)
      add(kWarning, "odometry.blind",
          "vision was lost " + std::to_string(run_.odometry->vision_losses) + " times, for " +
              fixed(run_.odometry->blind_s, 1) + " s in all",
          run_.odometry->has_imu
              ? "inertial sensing alone gives the poses of these times, which are less certain"
              : "the poses of these times are extrapolated, and less certain",
          "the log names the times: avoid blank walls, darkness and motion blur there");
    if (!run_.holes) return;
    const HolesSummary& holes = *run_.holes;
    if (holes.longest_s > kLongestPause_s)
      return add(kWarning, "frames.clock",
                 "stamps jump by " + fixed(holes.longest_s, 1) + " s, " +
                     fixed(holes.longest_from_s, 1) + " s after the first pose: the clock was set",
                 "odometry started again there, and charts show a gap",
                 "set the clock before the run, or choose a part by --from and --to");
    add(kWarning, "trajectory.hole",
        "no pose for " + fixed(holes.longest_s, 1) + " s, from " + fixed(holes.longest_from_s, 1) +
            " s on" +
            (holes.count == 1 ? ""
                              : ", the longest of " + std::to_string(holes.count) + " holes of " +
                                    fixed(holes.seconds, 1) + " s in all"),
        "the motion in this time is unknown: charts show a gap, and later poses are less certain",
        run_.frames_skipped > 0 ? "frames were skipped: for a recording --rate auto, which waits; "
                                  "fewer robots on this computer"
                                : "see sensor_faults in summary.json for missing images, and the "
                                  "log for new starts of odometry");
  }

  void add_cameras() {
    // Odometry that is wrong for a known reason estimates wrong errors of the cameras.
    const auto is_of_sensors = [](const Finding& one) {
      return one.id == "imu.time_offset" ||
             (one.severity == kError && !one.id.starts_with("network."));
    };
    if (!run_.cameras || std::ranges::any_of(run_.noticed, is_of_sensors)) return;
    const CamerasSummary& found = *run_.cameras;
    constexpr double kSure = 3.0;  // standard deviations
    constexpr double kOffset_s = 2e-3, kLargeOffset_s = 1e-2, kRotation_rad = 8.7e-3;
    constexpr double kReadout_s = 3e-3;
    const auto ms = [](double value_s, double sigma_s) {
      return fixed(1e3 * value_s, 1) + " ms (+- " + fixed(1e3 * sigma_s, 1) + ')';
    };
    if (std::abs(found.offset_s) > std::max(kOffset_s, kSure * found.offset_sigma_s))
      add(std::abs(found.offset_s) < kLargeOffset_s ? kNote : kWarning, "cameras.offset",
          "offset of the stamps of images to those of the inertial sensor: " +
              ms(found.offset_s, found.offset_sigma_s),
          "the offset was estimated and corrected, except at the start of the run",
          "set camera_time_offset_s in the rig file");
    if (found.readout_s > std::max(kReadout_s, kSure * found.readout_sigma_s))
      add(kNote, "cameras.rolling",
          "the readout of an image takes longer than tracker.readout_s: by " +
              ms(found.readout_s, found.readout_sigma_s),
          "a rolling shutter; odometry has estimated and corrected it, except at the start of the "
          "run",
          "if the readout time is known, set tracker.readout_s and lower "
          "vio.calibration_readout_s");
    const double rotation_rad =
        Eigen::Vector3d(found.rotation_x_rad, found.rotation_y_rad, found.rotation_z_rad).norm();
    if (rotation_rad > std::max(kRotation_rad, kSure * found.rotation_sigma_rad))
      add(kWarning, "cameras.turned",
          "the cameras are turned by " + fixed(kDegrees * rotation_rad, 2) + " degrees (+- " +
              fixed(kDegrees * found.rotation_sigma_rad, 2) + ") relative to their calibration",
          "odometry has estimated and corrected the rotation, the map has not",
          "calibrate cameras and inertial sensor again");
  }

  void add_resources() {
    if (run_.held_back) {
      const auto sum = [](const std::map<std::string, std::uint64_t>& by_category) {
        std::uint64_t total = 0;
        for (const auto& [category, count] : by_category) total += count;
        return total;
      };
      const auto text = [&](const TrafficSums& sums) {
        return std::to_string(sum(sums.messages)) + " messages (" +
               bytes_text(static_cast<double>(sum(sums.bytes))) + ')';
      };
      const auto& [delayed, superseded, dropped] = *run_.held_back;
      const bool is_lost = sum(dropped.messages) > 0;
      if (is_lost || sum(delayed.messages) > 0)
        add(is_lost ? kWarning : kNote, "budget.held_back",
            "the budget delayed " + text(delayed) + " and dropped " + text(dropped),
            is_lost ? "the other robots did not receive all of them"
                    : "the other robots received them later",
            is_lost ? "raise budget.bytes_per_s or budget.bytes_per_run" : "");
    }
    constexpr double kMuch = 20e6;
    const double growth = run_.process.memory_growth_bytes_per_minute.value_or(0.0);
    if (growth > kMuch)
      add(kWarning, "memory.grows",
          "memory grows by " + bytes_text(growth) + " a minute, to at most " +
              bytes_text(static_cast<double>(run_.process.peak_memory_bytes)) + " so far",
          "the memory may not suffice for a longer run",
          "lower semantic_mapping.max_blocks or window_m, or build a map without labels "
          "(mapping.mode)");
  }

  void add_map() {
    if (!run_.mapping) return;
    const MappingSummary& map = *run_.mapping;
    constexpr double kFew = 0.05;
    if (map.dropped_under_load > 0) {
      const auto left_out = static_cast<double>(map.dropped_under_load);
      const double share = left_out / (left_out + static_cast<double>(map.frames));
      add(share < kFew ? kNote : kWarning, "map.dropped_under_load",
          std::to_string(map.dropped_under_load) + " frames were left out of the map, " +
              percent(share),
          map.frames == 0
              ? "the processors were too slow, and odometry has priority: there is no map"
              : "the processors were too slow, and odometry has priority: the map may have holes",
          "for a recording --rate auto, which waits; a lower mapping.rate_hz, a higher "
          "stereo_depth.downscale, "
          "or a faster computer");
    }
    if (map.blocks_refused > 0)
      add(kWarning, "map.full",
          std::to_string(map.blocks_refused) + " blocks did not fit into the map",
          "the mesh has holes there", "raise semantic_mapping.max_blocks");
    if (map.skipped_too_late > map.frames)
      add(kWarning, "map.frames_late",
          std::to_string(map.skipped_too_late) + " frames were too late for the map, which has " +
              std::to_string(map.frames),
          "the map has fewer frames than mapping.rate_hz requests", "use a lower mapping.rate_hz");
  }

  const RunFacts& facts_;
  const RunSummary& run_;
  std::vector<Finding>& findings_;
};

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
  for (const RunFacts& run : runs) FindingsOfRun(run, findings);
  std::ranges::stable_partition(  // a network may explain the other findings on a team
      findings, [](const Finding& one) { return one.id.starts_with("network."); });
  sort_by_severity(findings);
  return findings;
}

Finding failed_run(const std::string& reason) {
  return {.id = kFailedRun,
          .severity = Severity::kError,
          .what = reason,
          .means = "the results are incomplete or unusable",
          .to_do = "see the log of the robot, and the exit codes in apps/robot/outputs.md"};
}

}  // namespace km
