#include "apps/robot/conclusion.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "apps/program_version.hpp"
#include "apps/result_files.hpp"
#include "apps/robot/peer_echo.hpp"
#include "apps/robot/results.hpp"
#include "apps/robot/robot_input.hpp"
#include "apps/robot/run_end.hpp"
#include "apps/robot/run_findings.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/write_file.hpp"
#include "modules/diagnosis/doubt_finding.hpp"
#include "modules/diagnosis/examine_sensors.hpp"
#include "modules/diagnosis/sensor_sample.hpp"
#include "runtime/log.hpp"
#include "runtime/metrics.hpp"

namespace km {
namespace {

std::string timings(const Robot& robot) {
  std::ostringstream out;
  out << "module,calls,median_ms,p95_ms,max_ms,total_s\n";
  for (const Node* node : robot.nodes()) {
    const DurationHistogram timing = node->timing();
    if (timing.count() == 0) continue;
    out << node->name() << ',' << timing.count() << ',' << 1e3 * timing.quantile_s(0.5) << ','
        << 1e3 * timing.quantile_s(0.95) << ',' << 1e3 * timing.max_s() << ',' << timing.total_s()
        << '\n';
  }
  return out.str();
}

// Faults of images, calibration, units and signs that the first 30 s of the recording of `options`
// show: possible causes for which odometry fails. kimera_multi_doctor states them in the same way.
// Reads these images again, which takes some seconds. Empty without a recording, or if it cannot be
// read.
std::vector<Finding> causes_of_failed_odometry(const RobotOptions& options,
                                               const RobotConfig& config,
                                               SignalWatch& signals) try {
  constexpr double kLook_s = 30.0;
  if (options.is_live || options.dataset.empty()) return {};
  RobotOptions part;
  part.dataset = options.dataset;
  part.rig = options.rig;
  part.from_s = options.from_s;
  part.to_s = std::min(options.from_s.value_or(0.0) + kLook_s, options.to_s.value_or(1e9));
  const auto input = open_robot_input(part, config, std::nullopt, read_rig_input(part), signals);
  if (!input) return {};
  DatasetReader& reader = *std::get<std::unique_ptr<DatasetReader>>(input->source);
  SensorSampler sampler;
  while (const auto packet = reader.next()) sampler.add(*packet);
  const SensorSample& sample = sampler.sample();
  const StereoRig& rig = reader.rig().stereo;
  Examination result = examine_images(sample);
  result.add(examine_stereo(sample, rig));
  result.add(examine_depth(sample, rig));
  result.add(examine_inertial(sample, rig));
  std::erase_if(result.findings, [](const Finding& f) { return f.severity == Severity::kNote; });
  return result.findings;
} catch (const std::runtime_error&) {  // a fault of the recording, which the run has reported
  return {};
}

// Call when the robot has stopped. `record` is final.
RunEnd end_of(const RobotOptions& options, const Robot& robot, const RunResult& result,
              const char* departure, const RunRecord& record) {
  RunEnd end{options.robot, result, robot.back_end().id_taken(), departure};
  end.is_live = options.is_live;
  if (const SensorsNode* sensors = robot.sensing().sensors()) {
    // The last image of former processes of this run is played once more.
    const bool is_repeated = options.resume && robot.sensing().restored_images() > 0;
    const std::size_t before = robot.sensing().restored_images() - (is_repeated ? 1 : 0);
    end.images = ImageCounts{before + sensors->listed(), before + sensors->published(),
                             sensors->skipped(), record.odometry().size()};
  }
  return end;
}

// Last line of a run.
void log_end(const RobotOptions& options, const RunEnd& end, const Verdict& verdict) {
  const std::string images = end.images ? ", " + to_string(*end.images) : "";
  if (verdict.exit_code != 0)
    log::error("robot") << verdict.reason;
  else
    log::info("robot") << "done (" << verdict.reason << ')' << images << ", results in "
                       << options.output.string();
}

HeldBackSums held_back(Robot& robot) {
  HeldBackSums sums;
  for (const TopicTraffic& topic : robot.bridge().traffic().topics) {
    if (topic.direction == Direction::kIn) continue;
    const std::string category = to_string(topic.category);
    const auto add = [&](TrafficSums& sum, const TrafficCount& count) {
      sum.messages[category] += count.messages;
      sum.bytes[category] += count.bytes;
    };
    add(sums.delayed, topic.held.delayed);
    add(sums.superseded, topic.held.superseded);
    add(sums.dropped, topic.held.dropped);
  }
  return sums;
}

// Completes the MCAP record with the other results as attachments, among them the closures.
void finish_record(const RobotOptions& options, RosOutputNode& node, const RunRecord& record,
                   const RunResult& result, ResultWriter& results) {
  if (result.is_left_behind(node.name()))
    return results.note(*options.record, "has no end: its module hangs");
  std::map<std::string, std::string> files;
  for (const char* name : {"config.yaml", "keyframes.csv", "loop_closures.csv"})
    if (is_file(options.output / name)) files[name] = read_input_file(options.output / name);
  node.finish(record.optimized(), published_closures(record), files);
  if (node.dropped() > 0)
    log::warn("record") << node.dropped() << " messages and images are missing in "
                        << options.record->string() << ": they came faster than they were written";
}

// Writes all results except for the summary. The state of a hung module cannot be read.
void write_all(const StoppedRun& run, ResultWriter& results) {
  const auto& [options, config, robot, result, record] = run;
  write_results(options.output, record, results);
  if (result.is_left_behind("mesh_files"))
    results.note(options.output / "mesh.ply", "not as at the end of the run: mesh_files hangs");
  else if (robot.mapping().files() != nullptr)
    robot.mapping().files()->finish(record.trajectory());
  if (robot.mapping().team_map() != nullptr &&
      !result.is_left_behind(robot.mapping().team_map()->name()))
    write_team_map(options.output, config.map_2d, *robot.mapping().team_map(), results);
  if (robot.mapping().objects() != nullptr &&
      !result.is_left_behind(robot.mapping().objects()->name()))
    if (const auto objects = robot.mapping().objects()->finish(record.trajectory()))
      write_objects(options.output, *objects, robot.mapping().objects()->palette(), results);
  if (robot.records().record() != nullptr)
    finish_record(options, *robot.records().record(), record, result, results);
  results.write(options.output / "timing.csv",
                [&robot](const auto& file) { write_file(file, timings(robot)); });
}

FixesSummary fixes_summary(const Robot& robot, const RunRecord& record) {
  const FixCounts counts = robot.places().fixes()->counts();
  const FixesState state = record.progress().fixes.value_or(FixesState{});
  FixesSummary summary{.located = record.progress().located && record.trajectory().has_value(),
                       .after_s = robot.records().progress().located_after_s(),
                       .used = state.used,
                       .rejected = state.rejected,
                       .residual_m = state.residual_m,
                       .rotation_sigma_rad = state.rotation_sigma_rad,
                       .received = counts.received,
                       .not_used = {{"without a position", counts.without_position},
                                    {"not finite", counts.not_finite},
                                    {"too uncertain", counts.too_uncertain},
                                    {"more than 40 km from the datum", counts.far_from_datum},
                                    {"out of order", counts.out_of_order},
                                    {"malformed", counts.malformed},
                                    {"not nearest to a keyframe", counts.far_from_keyframe}},
                       .datum = {},
                       .odometry_frame = {}};
  std::erase_if(summary.not_used, [](const auto& reason) { return reason.second == 0; });
  if (const auto datum = robot.places().fixes()->datum())
    summary.datum = {datum->latitude_deg, datum->longitude_deg, datum->altitude_m};
  const auto& trajectory = record.trajectory();
  if (!summary.located || trajectory->T_world_kf.size() > record.keyframes().size()) return summary;
  const std::size_t last = trajectory->T_world_kf.size() - 1;
  const SE3 T = trajectory->T_world_kf[last] * record.keyframes()[last].T_odom_kf.inverse();
  summary.odometry_frame = {T.translation().x(), T.translation().y(), T.translation().z(),
                            std::atan2(T(1, 0), T(0, 0))};
  return summary;
}

std::map<RobotId, std::string> peer_names(Robot& robot) {
  std::map<RobotId, std::string> names;
  for (const Peer& peer : robot.bridge().peers().list())
    names[peer.identity.robot] = peer.identity.name;
  return names;
}

std::vector<Finding> what_stands_out(const RunFacts& facts, const Verdict& verdict) {
  std::vector<Finding> findings = findings_of({&facts, 1});
  if (verdict.exit_code != 0) findings.insert(findings.begin(), failed_run(verdict.reason));
  return findings;
}

// Reports of the robot, its network and its sensors, beside the record.
void add_reports(RunSummary& summary, const StoppedRun& run, const RunEnd& end,
                 const Watch& watch) {
  const auto& [options, config, robot, result, record] = run;
  summary.frames = end.images.value_or(ImageCounts{}).read;
  summary.frames_skipped = end.images.value_or(ImageCounts{}).skipped;
  if (const SensorsNode* sensors = robot.sensing().sensors()) {
    summary.paused_s = sensors->paused_s();
    const ReaderReport faults = sensors->faults();
    for (const auto& [fault, entry] : faults.entries()) {
      summary.sensor_faults[to_string(fault)] = entry.count;
      if (fault == ReaderFault::kClockSetBack)
        summary.noticed.push_back(finding_of(fault, entry, static_cast<double>(summary.frames)));
    }
    for (const Doubt& doubt : sensors->doubts()) summary.noticed.push_back(finding_of(doubt));
  }
  summary.traffic = robot.records().sent_bytes();
  if (const LocalizationNode* localization = robot.places().localization())
    summary.localization = {options.localize.string(), record.progress().located,
                            robot.records().progress().located_after_s(), localization->compared(),
                            localization->matched()};
  if (robot.places().fixes() != nullptr) summary.fixes = fixes_summary(robot, record);
  if (config.budget.is_limited()) summary.held_back = held_back(robot);
  summary.process = watch.process();
  summary.seconds = watch.seconds();
  for (const MissedPeer& peer : end.missed)
    (peer.why == Absence::kSilent ? summary.lost_peers : summary.apart_peers)[peer.name] =
        peer.missed_s;
  summary.unmet_peers = end.unmet;
  summary.forged_announcements = robot.bridge().peers().ask(&PeerTable::forged_announcements);
}

// Reasons why robots that were met did not join: paths that drop large packets.
std::vector<Finding> path_findings(const StoppedRun& run) {
  constexpr std::size_t kEchoes = 2;
  constexpr int kHeaders_bytes = 28;
  std::vector<Finding> found;
  const std::vector<RobotId>& joined = run.record.progress().members;
  const int packet_bytes = largest_datagram(run.config.dds, run.robot.interface()) + kHeaders_bytes;
  for (const Peer& peer : run.robot.bridge().peers().list()) {
    const std::size_t host = peer.addresses.find("udp/");
    if (host == std::string::npos || std::ranges::count(joined, peer.identity.robot) > 0) continue;
    PeerEcho echo = ask_peer(peer.addresses.substr(host + 4), packet_bytes, kEchoes);
    echo.host = peer.identity.name;
    if (auto finding = path_finding(echo)) found.push_back(*std::move(finding));
  }
  return found;
}

void warn_unlocated(const RobotOptions& options, const RunSummary& summary,
                    const RunRecord& record) {
  if (summary.fixes && !summary.fixes->located)
    log::warn("robot") << "not located in the frame of absolute_fixes: the poses are those of "
                          "odometry ("
                       << summary.fixes->used << " fixes used, " << summary.fixes->rejected
                       << " rejected)";
  if (summary.localization && !summary.localization->localised)
    log::warn("robot") << "not localised in " << summary.localization->map
                       << ": the poses are those of odometry";
  if (!options.extend.empty() && !record.progress().located)
    log::warn("robot") << "not localised in " << options.extend.string()
                       << ": the poses of this run are those of odometry, apart from those before";
}

}  // namespace

int conclude(const StoppedRun& run, std::optional<Watch>& watch, FinalRoom& room,
             ResultWriter& results, SignalWatch& signals) {
  const auto& [options, config, robot, result, record] = run;
  watch->finish(record);
  RunEnd end = end_of(options, robot, result, watch->reason(), record);
  const PeerTable::SameId same_id = robot.bridge().peers().ask(&PeerTable::same_id);
  end.id_taken |= same_id == PeerTable::SameId::kOpen;
  end.is_alone = watch->is_alone();
  end.missed = watch->missed();
  end.unmet = watch->unmet();
  RunSummary summary = summary_of(record);
  summary.name = options.name;
  summary.version = built_version();
  summary.commit = built_commit();
  add_reports(summary, run, end, *watch);
  const std::map<RobotId, std::string> names = peer_names(robot);
  const auto by_name = [&names](const std::map<RobotId, std::uint64_t>& counts) {
    std::map<std::string, std::uint64_t> result;
    for (const auto& [peer, count] : counts)
      result[names.contains(peer) ? names.at(peer) : std::to_string(peer)] = count;
    return result;
  };
  summary.other_vocabulary = by_name(record.other_vocabulary());
  summary.other_network = by_name(record.other_network());
  watch.reset();  // ends the status line before the last log lines
  warn_unlocated(options, summary, record);
  room.release_trajectories();
  write_all(run, results);
  if (summary.odometry && !result.interrupted &&
      (summary.odometry->divergences > 0 || summary.odometry->starts == 0)) {
    log::warn("robot") << "odometry failed: looking at the recording for the cause";
    for (Finding& found : causes_of_failed_odometry(options, config, signals))
      if (std::ranges::find(summary.noticed, found.id, &Finding::id) == summary.noticed.end())
        summary.noticed.push_back(std::move(found));
    const auto fault = std::ranges::find(summary.noticed, Severity::kError, &Finding::severity);
    if (fault != summary.noticed.end()) end.odometry_fault = fault->what;
  }
  if (!result.interrupted)  // a signal ends the robot at once
    for (Finding& path : path_findings(run)) {
      log::warn("peers") << path.what;
      summary.noticed.push_back(std::move(path));
    }
  if (end.id_taken || same_id != PeerTable::SameId::kNone)
    summary.noticed.push_back(
        {.id = "network.same_id",
         .severity = end.id_taken ? Severity::kError : Severity::kWarning,
         .what = "another robot had this robot's id " + std::to_string(options.robot),
         .means = "the robots of the team may have taken the data of one for those of the other",
         .to_do = "give every robot its own --robot, and run again"});
  end.lost_results = results.lost();
  summary.exit_reason = verdict_of(end).reason;
  summary.findings =
      what_stands_out({summary, record.closure_tallies(), names, config.pcm}, verdict_of(end));
  room.release_summary();
  results.write(
      options.output / "summary.json",  // last, because it lists the results that were lost
      [&summary](const auto& file) { write_summary(file, summary); });
  end.lost_results = results.lost();
  const Verdict verdict = verdict_of(end);
  log_end(options, end, verdict);
  return verdict.exit_code;
}

}  // namespace km
