#include "apps/doctor/examine.hpp"

#include <algorithm>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <variant>

#include "apps/result_files.hpp"
#include "apps/robot/robot_input.hpp"
#include "apps/robot/run_findings.hpp"
#include "apps/shipped_file.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/diagnosis/doubt_finding.hpp"
#include "modules/diagnosis/examine_sensors.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "runtime/clock.hpp"
#include "runtime/ros/ros_subscription.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

using enum Severity;

Examination refused(
    const std::string& why,
    const std::string& to_do =
        "correct the stated fault; kimera_multi_robot --inspect lists the contents") {
  return {.figures = {},
          .findings = {{.id = "recording.refused",
                        .severity = kError,
                        .what = why,
                        .means = "no robot can play this input",
                        .to_do = to_do}}};
}

// Stops a live reader after some seconds, also while the reader waits for silent sensors.
class Stopper {
 public:
  Stopper(DatasetReader& reader, double seconds)
      : thread_([this, &reader, seconds](const std::stop_token& stop) {
          std::unique_lock lock(mutex_);
          ended_.wait_for(lock, stop, steady_duration(seconds), [] { return false; });
          reader.stop();
        }) {}

 private:
  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::jthread thread_;  // last member: stops first
};

SensorSample sample_of(DatasetReader& reader, double live_s, const ReportProgress& report_progress,
                       std::vector<Doubt>& doubts) {
  std::optional<Stopper> stopper;
  if (live_s > 0.0) stopper.emplace(reader, live_s);
  SensorSampler sampler;
  FirstPackets first;
  const auto total = static_cast<double>(reader.pair_count());
  for (double done = 0.0; const auto packet = reader.next(); ++done) {
    report_progress("looking at images", total > 0.0 ? done / total : 0.0);
    sampler.add(*packet);
    for (Doubt& found : first.add(*packet, reader.rig().stereo.cameras[0]))
      doubts.push_back(std::move(found));
  }
  return sampler.sample();
}

Finding silent(const ListenedTopic& wanted, const std::vector<ListenedTopic>& topics,
               const std::vector<TopicPublisher>& publishers) {
  const auto is_named = [&topics](const std::string& name) {
    return std::ranges::find(topics, name, &ListenedTopic::topic) != topics.end();
  };
  const Silence silence = why_silent(wanted.topic, wanted.type, is_named, publishers);
  return {.id = std::string("live.") + silence.kind,
          .severity = kError,
          .what = "no message on " + wanted.topic + " (" + wanted.type + "): " + silence.why,
          .means = "the robot waits for this topic",
          .to_do = silence.to_do};
}

Finding unfinished_run(const fs::path& folder) {
  return {.id = "run.unfinished",
          .severity = kWarning,
          .what = unfinished(folder),
          .means =
              "trajectory, closures and map are not written yet; run.journal holds them up to the "
              "last second",
          .to_do = way_on(folder)};
}

// Note on a missing or invalid file, which need not be a fault of the run.
Finding missing(const char* file, const std::string& why) {
  return {.id = std::string("results.") + file,
          .severity = kNote,
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

// Findings on the packets of a reader: for `live_s` if it is above 0, otherwise up to the end.
Examination examine_packets(DatasetReader& reader, const RobotConfig& config, double live_s,
                            const ReportProgress& report_progress) {
  std::vector<Doubt> doubts;
  const SensorSample sample = sample_of(reader, live_s, report_progress, doubts);
  report_progress("comparing", 0.0);
  Examination result = examine_streams(sample, reader.report());
  for (const std::string& remark : reader.remarks())
    result.add(kNote, "recording.remark", remark, "the reader takes this into account");
  if (sample.frames.empty()) return result;
  const StereoRig& rig = reader.rig().stereo;
  result.add(examine_images(sample));
  result.add(examine_stereo(sample, rig));
  result.add(examine_depth(sample, rig));
  result.add(examine_inertial(sample, rig));
  result.add(examine_words(sample.descriptors, load_vocabulary(find_shipped_file(
                                                   config.run.vocabulary, "run.vocabulary"))));
  for (const Doubt& found : doubts)
    if (!has(result, found.id)) result.findings.push_back(finding_of(found));
  sort_by_severity(result.findings);
  return result;
}

}  // namespace

Examination examine_recording(const RobotOptions& options, const RobotConfig& config, double live_s,
                              const ReportProgress& report_progress) try {
  if (const fs::path& file = options.dataset;
      is_file(file) && (file.extension() == ".g2o" || file.extension() == ".jrl"))
    return refused(file.string() + ": a pose graph, not a recording",
                   "kimera_multi_pgo solve " + file.string());
  const auto input = [&] {
    SignalWatch signals;  // interrupts the wait for a live calibration
    return open_robot_input(options, config, std::nullopt, read_rig_input(options), signals);
  }();
  if (!input) return refused("interrupted before the calibration was complete");
  return examine_packets(*std::get<std::unique_ptr<DatasetReader>>(input->source), config,
                         options.is_live ? live_s : 0.0, report_progress);
} catch (const DatasetError& error) {
  return refused(error.what());
} catch (const ConfigError& error) {
  return refused(error.what());
} catch (const InputFileError& error) {
  return refused(error.what());
}

Examination examine_topics(const std::vector<ListenedTopic>& topics,
                           const std::vector<TopicPublisher>& publishers, double listened_s,
                           int domain) {
  Examination result;
  for (const ListenedTopic& topic : topics)
    result.figure(topic.topic, std::to_string(topic.messages) + " messages of " + topic.type +
                                   " in " + fixed(listened_s, 1) + " s");
  const auto is_silent = [](const ListenedTopic& topic) { return topic.messages == 0; };
  if (publishers.empty() && std::ranges::all_of(topics, is_silent)) {
    result.add(kError, "live.no_publishers",
               "no program publishes a topic on domain " + std::to_string(domain) + " of ROS",
               "no driver runs, or the drivers use another domain or interface",
               "set ros.domain to the ROS_DOMAIN_ID of the drivers; check ros.interface and "
               "ros.peers");
    return result;
  }
  for (const ListenedTopic& topic : topics)
    if (is_silent(topic)) result.findings.push_back(silent(topic, topics, publishers));
  return result;
}

Examination examine_live_topics(const SensorTopicNames& names, const RosConfig& config,
                                double listen_s, const ReportProgress& report_progress) {
  const auto network = std::make_shared<const RosNetwork>(config);
  RosDiscovery discovery(*network);
  RosSubscription subscription(network, live_topics(names));
  std::vector<ListenedTopic> topics;
  for (const RosTopic& topic : subscription.topics()) topics.push_back({topic.topic, topic.type});
  const double start_s = steady_now_s();
  subscription.give_up_after(listen_s);
  while (const auto message = subscription.next()) {
    report_progress("listening", (steady_now_s() - start_s) / listen_s);
    ++topics[message->topic].messages;
  }
  return examine_topics(topics, discovery.publishers(), listen_s, config.domain);
}

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
