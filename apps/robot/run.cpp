#include "apps/robot/run.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "apps/output_file.hpp"
#include "apps/program_version.hpp"
#include "apps/result_files.hpp"
#include "apps/result_writer.hpp"
#include "apps/robot/failed_odometry.hpp"
#include "apps/robot/growing_files.hpp"
#include "apps/robot/results.hpp"
#include "apps/robot/run_end.hpp"
#include "apps/robot/run_findings.hpp"
#include "apps/robot/status.hpp"
#include "apps/robot/wiring.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/text_table.hpp"
#include "modules/core/write_file.hpp"
#include "modules/diagnosis/doubt_finding.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"
#include "runtime/metrics.hpp"
#include "runtime/thread.hpp"
#include "runtime/unblocked_output.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

bool is_fault_of_disk(const std::error_code& error) {
  return error == std::errc::no_space_on_device || error == std::errc::io_error;
}

// Changes the results folder before the run. If the disk fails, the loss is noted and the robot
// runs without it. Throws std::runtime_error for a folder that cannot be used or is read-only.
void change_output(const RobotOptions& options, ResultWriter& results,
                   const std::function<void(const fs::path&)>& change) try {
  change(options.output);
} catch (const fs::filesystem_error& error) {
  if (!is_fault_of_disk(error.code()))
    throw std::runtime_error(options.output.string() + ": cannot be written to: " +
                             error.code().message() + "; choose another folder for the results");
  results.note(options.output, error.code().message());
}

void make_output(const fs::path& folder) {
  fs::create_directories(folder);
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw fs::filesystem_error("", std::error_code(errno, std::generic_category()));
}

// Call when all inputs of the run have been checked, because earlier results are removed.
void remove_former(const fs::path& folder, bool continues, bool resume) {
  if (!resume && is_file(folder / kSummary))
    log::info("robot") << folder.string() << ": the results of an earlier run are replaced";
  remove_results(folder, continues);
  if (resume) return;
  for (const char* file : {kJournal, kMapFile}) fs::remove(folder / file);
}

// The journal and the map of the run to extend, if this process begins to do so, as the beginning
// of this run.
void copy_extended(const RobotOptions& options) {
  if (options.extend.empty() || options.resume) return;
  for (const char* file : {kJournal, kMapFile})
    if (is_file(options.extend / file)) fs::copy_file(options.extend / file, options.output / file);
}

void log_network(const RobotConfig& config, const NetworkInterface& interface) {
  const char* const discovery =
      config.dds.discovery == Discovery::kMulticast ? "multicast" : "address";
  log::info("dds") << "domain " << config.dds.domain << " on " << interface.name << " ("
                   << interface.address << "), link " << config.run.link
                   << ", datagrams of at most " << largest_datagram(config.dds, interface)
                   << " B, peers by " << discovery;
}

// Work beside the modules while they run: phase, status line, traffic and memory over time.
class Watch {
 public:
  /// `continues`: continues the run whose results are in the folder.
  Watch(const RobotOptions& options, const RobotConfig& config, bool continues,
        std::set<RobotId> partners, Robot& robot, ResultWriter& results)
      : robot_(robot),
        is_past_(!options.session.empty()),
        partners_(std::move(partners)),
        serve_limit_s_(options.serve_limit_s),
        departure_(config.run.settle_s, options.serve_limit_s),
        start_s_(steady_now_s()),
        traffic_file_(options.output / "traffic.csv", results),
        traffic_csv_(traffic_file_.rows(), continues ? traffic_file_.go_on() : std::string()),
        process_file_(options.output / "process.csv", results),
        process_csv_(process_file_.rows(), continues ? process_file_.go_on() : std::string()),
        rounds_file_(options.output / "optimizer.csv", results),
        rounds_csv_(rounds_file_.rows(), continues ? rounds_file_.go_on() : std::string()) {
    for (const std::string& host : config.dds.peers)
      if (!host.starts_with("127.") && host != robot.interface().address) hosts_.push_back(host);
  }

  /// True when the robot may leave, or must leave because another robot has its id. Called ten
  /// times a second.
  bool poll() {
    const double now_s = steady_now_s() - start_s_;
    const TrafficSnapshot traffic = robot_.bridge().traffic();
    const bool ended = robot_.input_ended();
    // If the recorder is at work, the next call reads the record: this thread does not wait.
    (void)robot_.recorder().try_with_record([&](const RunRecord& record) {
      log_progress(now_s, record, traffic);
      rounds_csv_.append(record.rounds());
      if (leaving_since_s_) return;
      const std::map<RobotId, Departure::Present> peers = present_peers();
      std::vector<Departure::Present> present;
      for (const auto& [robot, peer] : peers) present.push_back(peer);
      const auto& team = record.progress().members;
      const auto not_received = std::count_if(team.begin(), team.end(), [&](RobotId member) {
        return member != record.robot() && !peers.contains(member);
      });
      // Messages that wait for the budget may change the graphs of other robots.
      const bool settled =
          record.settled() && !robot_.bridge().holds_back() && robot_.has_shared_map();
      const auto reported =
          departure_.update(now_s, {.input_ended = ended,
                                    .graph_settled = settled,
                                    .activity = record.activity(),
                                    .present_peers = present,
                                    .not_received = static_cast<std::size_t>(not_received),
                                    .awaits_peers = ended && awaits_peers(team)});
      robot_.set_settled(reported);
      absentees_.update(now_s, known_peers(), team);
      note_unmet(now_s);
      const auto running = [](const auto& peer) { return peer.phase == RobotPhase::kRunning; };
      if (reported.phase == RobotPhase::kSettled && std::ranges::none_of(present, running))
        robot_.expect_no_more_closures();
    });
    if (now_s - written_s_ >= kInterval_s) write(now_s, traffic);
    if (now_s - sampled_s_ >= kInterval_s && !leaving_since_s_) sample(now_s);
    if (now_s >= next_trim_s_) {
      return_freed_memory();
      next_trim_s_ = now_s + kTrimInterval_s;
    }
    return robot_.id_taken() || (departure_.reason() != nullptr && leave_notice_sent(now_s));
  }

  /// `record` is final.
  void finish(const RunRecord& record) {
    rounds_csv_.append(record.rounds());
    write(seconds(), robot_.bridge().traffic());
  }
  [[nodiscard]] ProcessSummary process() const { return process_csv_.summary(); }
  [[nodiscard]] double seconds() const { return steady_now_s() - start_s_; }
  [[nodiscard]] const char* reason() const { return departure_.reason(); }
  [[nodiscard]] std::vector<MissedPeer> missed() const { return absentees_.missed(kSecondHand_s); }
  [[nodiscard]] std::map<std::string, std::string> unmet() const {
    std::map<std::string, std::string> reasons;
    for (const auto& [name, unmet] : unmet_) reasons[name] = unmet.why;
    return reasons;
  }

 private:
  struct Unmet {
    std::string why = {};
    double since_s = 0.0, last_s = 0.0;
    bool is_logged = false;
  };

  static constexpr double kInterval_s = 1.0;  // between rows of a CSV, and status lines
  // Threads free what other threads allocate, so that free memory spreads over the heaps of all
  // threads. Returned each minute, it costs a robot the page faults of a few images.
  static constexpr double kTrimInterval_s = 60.0;
  static constexpr double kLeaveNotice_s = 1.5;  // three times the period of the status
  // In a chain, robots leave one after the other. The first ones have left before the last one
  // receives a notice.
  static constexpr double kSecondHand_s = 2.0 * kLeaveNotice_s;

  // The robot of a finished run awaits any other robot. A recorded graph has closures to robots
  // that may start later.
  bool awaits_peers(std::span<const RobotId> team) {
    const std::vector<Peer> met = robot_.bridge().peers().list();
    for (const Peer& peer : met) partners_.erase(peer.identity.robot);
    for (const RobotId robot : team) partners_.erase(robot);  // that other robots receive
    if (!partners_.empty() && !std::exchange(told_, true)) {
      std::string names;
      for (const RobotId robot : partners_) names += ' ' + std::to_string(robot);
      log::info("robot") << "closures of the graph lead to robots that have not come:" << names
                         << "; waits for them, up to --serve-limit " << serve_limit_s_ << " s";
    }
    return !partners_.empty() || (is_past_ && met.empty());
  }

  // Publishes that the robot leaves, and freezes the record, so that all robots end with the same
  // solution. True once the peers have had the time to receive this.
  bool leave_notice_sent(double now_s) {
    if (!leaving_since_s_) {
      leaving_since_s_ = now_s;
      robot_.set_settled({RobotPhase::kLeaving, kMaxSettledLinks});
      sample(now_s);
      robot_.freeze_record();
    }
    return robot_.bridge().peers().list().empty() || now_s - *leaving_since_s_ >= kLeaveNotice_s;
  }

  // Logs a robot once that has been unmet for some time: discovery takes less. Keeps a named one
  // while a new participant discovers it again.
  void note_unmet(double now_s) {
    constexpr double kUnmet_s = 5.0, kKept_s = 10.0;
    const std::vector<Peer> met = robot_.bridge().peers().list();
    auto unmet_now = robot_.bridge().peers().ask(&PeerTable::unmet);
    if (met.empty() && unmet_now.empty())
      for (const std::string& host : hosts_)
        unmet_now["dds.peers " + host] =
            "no robot there is received: none runs, or a firewall or NAT is between";
    for (const auto& [name, why] : unmet_now) {
      Unmet& unmet = unmet_.try_emplace(name, Unmet{.since_s = now_s}).first->second;
      unmet.why = why;
      unmet.last_s = now_s;
      if (now_s - unmet.since_s >= kUnmet_s && !std::exchange(unmet.is_logged, true))
        log::warn("peers") << name << " is not met: " << why;
    }
    std::erase_if(unmet_, [now_s](const auto& entry) {
      const double gone_s = now_s - entry.second.last_s;
      return gone_s > (entry.first.ends_with(')') ? kKept_s : 0.0);
    });
    for (const Peer& peer : met) unmet_.erase(to_string(peer.identity));
  }

  // Less often than poll(), because the time to count closures grows with their number.
  void log_progress(double now_s, const RunRecord& record, const TrafficSnapshot& traffic) {
    if (now_s - logged_s_ < kInterval_s) return;
    logged_s_ = now_s;
    status_line_.update(status_text(robot_.dataset_time_s(), record, robot_.bridge().peers().list(),
                                    traffic, process_usage().resident_bytes));
  }

  // A peer whose last status announced that it leaves, and that is silent now, has left.
  std::map<RobotId, Absentees::Known> known_peers() const {
    using enum Absentees::Contact;
    std::map<RobotId, Absentees::Known> known;
    const auto contact_of = [](PeerState state) {
      switch (state) {
        case PeerState::kAlive:
          return kReceived;
        case PeerState::kLost:
          return kSilent;
        case PeerState::kReported:
          return kReported;
        case PeerState::kLeft:
          break;
      }
      return kLeft;
    };
    for (const Peer& peer : robot_.bridge().peers().list())
      known[peer.identity.robot] = {peer.identity.name, contact_of(peer.state)};
    for (const RobotStatus& status : robot_.status_node().peers()) {
      const auto peer = known.find(status.robot);
      if (status.phase == RobotPhase::kLeaving && peer != known.end() &&
          peer->second.contact == kSilent)
        peer->second.contact = kLeft;
    }
    return known;
  }

  // A peer that is present but has not yet sent a status counts as running, regardless of the last
  // status of its former process.
  std::map<RobotId, Departure::Present> present_peers() const {
    std::map<TeamPeer, Departure::Present> reported;
    for (const RobotStatus& status : robot_.status_node().peers())
      reported[{status.robot, status.boot}] = {status.phase, status.settled_links};
    std::map<RobotId, Departure::Present> present;
    for (const auto& [identity, state, addresses] : robot_.bridge().peers().list())
      if (state == PeerState::kAlive)
        present[identity.robot] = reported[{identity.robot, identity.boot}];
    return present;
  }

  void sample(double now_s) {
    sampled_s_ = now_s;
    robot_.publish_sample();
  }

  void write(double now_s, const TrafficSnapshot& traffic) {
    const double run_s = process_csv_.former_s() + now_s;
    traffic_csv_.append(run_s, traffic);
    traffic_file_.flush();
    process_csv_.append(run_s, process_usage());
    process_file_.flush();
    rounds_file_.flush();
    written_s_ = now_s;
  }

  Robot& robot_;
  const bool is_past_;
  std::set<RobotId> partners_;  // robots of the recorded graph that have not come yet
  bool told_ = false;           // the log names them
  const double serve_limit_s_;
  Departure departure_;
  Absentees absentees_;
  std::vector<std::string> hosts_;      // other hosts in dds.peers
  std::map<std::string, Unmet> unmet_;  // by name
  double start_s_;
  GrowingFile traffic_file_;
  TrafficCsv traffic_csv_;
  GrowingFile process_file_;
  ProcessCsv process_csv_;
  GrowingFile rounds_file_;
  RoundsCsv rounds_csv_;
  double written_s_ = 0.0;
  double logged_s_ = -kInterval_s;
  double sampled_s_ = -kInterval_s;
  double next_trim_s_ = 0.0;  // at once: the start frees most of what it takes
  std::optional<double> leaving_since_s_;
  StatusLine status_line_;
};

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

// Call when the robot has stopped. `record` is final.
RunEnd end_of(const RobotOptions& options, const Robot& robot, const RunResult& result,
              const char* departure, const RunRecord& record) {
  RunEnd end{options.robot, result, robot.id_taken(), departure};
  end.is_live = options.is_live;
  if (const SensorsNode* sensors = robot.sensors()) {
    // The last image of former processes of this run is played once more.
    const bool is_repeated = options.resume && robot.restored_images() > 0;
    const std::size_t before = robot.restored_images() - (is_repeated ? 1 : 0);
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

// Allocates the bytes of a file from its present end up to `bytes`. Returns an error, or 0.
int allocate(const std::filesystem::path& file, std::uint64_t from, std::uint64_t bytes) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (descriptor < 0) return errno;
  const int error =
      posix_fallocate(descriptor, static_cast<off_t>(from), static_cast<off_t>(bytes - from));
  if (error != 0) (void)!ftruncate(descriptor, static_cast<off_t>(from));
  close(descriptor);
  return error;
}

// Room on the disk for a result that is written at the end of the run. A file of that size keeps
// the room, and is removed just before the result is written.
class ReservedRoom {
 public:
  // A file that a killed process has left is removed.
  explicit ReservedRoom(fs::path file) : file_(std::move(file)) { release(); }
  ~ReservedRoom() { release(); }
  ReservedRoom(const ReservedRoom&) = delete;
  ReservedRoom& operator=(const ReservedRoom&) = delete;

  // If the disk is full, the room that is already reserved stays, and a warning names the bytes.
  void reserve(std::uint64_t bytes) {
    if (bytes <= reserved_bytes_) return;
    // A step of this size makes the calls rare.
    constexpr std::uint64_t kStep_bytes = std::uint64_t{16} << 10U;
    bytes = (bytes / kStep_bytes + 1) * kStep_bytes;
    if (const int error = allocate(file_, reserved_bytes_, bytes))
      log::limited(log::Level::kWarn, "results", file_.string())
          << file_.string() << ": no room for " << bytes
          << " bytes of results at the end of the run: " << std::generic_category().message(error);
    else
      reserved_bytes_ = bytes;
  }

  void release() noexcept {
    unlink(file_.c_str());
    reserved_bytes_ = 0;
  }

 private:
  const fs::path file_;
  std::uint64_t reserved_bytes_ = 0;
};

// Room for the results that matter most: trajectories and summary.
class FinalRoom {
 public:
  /// `images`: number of images of the recording, 0 if unknown.
  FinalRoom(const fs::path& output, std::size_t images)
      : trajectories_(output / kTrajectoryRoom), summary_(output / kSummaryRoom) {
    summary_.reserve(kSummary_bytes);
    grow(images, 0);
  }

  /// Reserves room for the poses of these numbers of images and keyframes.
  void grow(std::size_t images, std::size_t keyframes) {
    trajectories_.reserve(kImage_bytes * images + kKeyframe_bytes * keyframes);
  }
  void release_trajectories() { trajectories_.release(); }
  void release_summary() { summary_.release(); }

 private:
  // Rows of odometry.tum and optimized.tum, which has a row for each keyframe if there are no
  // images; and of optimized_keyframes.tum with its 36 numbers.
  static constexpr std::size_t kImage_bytes = 240, kKeyframe_bytes = 700;
  static constexpr std::size_t kSummary_bytes = 32768;

  ReservedRoom trajectories_, summary_;
};

// Writes all results except for the summary. The state of a hung module cannot be read.
void write_all(const RobotOptions& options, const RobotConfig& config, Robot& robot,
               const RunRecord& record, const RunResult& result, ResultWriter& results) {
  write_results(options.output, record, results);
  if (result.is_left_behind("mesh_files"))
    results.note(options.output / "mesh.ply", "not as at the end of the run: mesh_files hangs");
  else if (robot.mesh_files() != nullptr)
    robot.mesh_files()->finish(record.trajectory());
  if (robot.team_map() != nullptr && !result.is_left_behind(robot.team_map()->name()))
    write_team_map(options.output, config.map_2d, *robot.team_map(), results);
  if (robot.objects() != nullptr && !result.is_left_behind(robot.objects()->name()))
    if (const auto objects = robot.objects()->finish(record.trajectory()))
      write_objects(options.output, *objects, robot.objects()->palette(), results);
  if (robot.record() != nullptr) finish_record(options, *robot.record(), record, result, results);
  results.write(options.output / "timing.csv",
                [&robot](const auto& file) { write_file(file, timings(robot)); });
}

FixesSummary fixes_summary(const Robot& robot, const RunRecord& record) {
  const FixCounts counts = robot.fixes()->counts();
  const FixesState state = record.progress().fixes.value_or(FixesState{});
  FixesSummary summary{.located = record.progress().located && record.trajectory().has_value(),
                       .after_s = robot.located_after_s(),
                       .used = state.used,
                       .rejected = state.rejected,
                       .residual_m = state.residual_m,
                       .rotation_sigma_rad = state.rotation_sigma_rad,
                       .received = counts.received,
                       .not_used = {{"without a position", counts.without_position},
                                    {"not finite", counts.not_finite},
                                    {"too uncertain", counts.too_uncertain},
                                    {"out of order", counts.out_of_order},
                                    {"malformed", counts.malformed},
                                    {"not nearest to a keyframe", counts.far_from_keyframe}},
                       .datum = {},
                       .odometry_frame = {}};
  std::erase_if(summary.not_used, [](const auto& reason) { return reason.second == 0; });
  if (const auto datum = robot.fixes()->datum())
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

// Writes the results of the run and returns the exit code.
int conclude(const RobotOptions& options, const RobotConfig& config, Robot& robot,
             std::optional<Watch>& watch, const RunResult& result, const RunRecord& record,
             FinalRoom& room, ResultWriter& results, SignalWatch& signals) {
  watch->finish(record);
  RunEnd end = end_of(options, robot, result, watch->reason(), record);
  end.missed = watch->missed();
  end.unmet = watch->unmet();
  RunSummary summary = summary_of(record);
  summary.name = options.name;
  summary.version = built_version();
  summary.commit = built_commit();
  summary.frames = end.images.value_or(ImageCounts{}).read;
  summary.frames_skipped = end.images.value_or(ImageCounts{}).skipped;
  if (const SensorsNode* sensors = robot.sensors()) {
    summary.paused_s = sensors->paused_s();
    const ReaderReport faults = sensors->faults();
    for (const auto& [fault, entry] : faults.entries())
      summary.sensor_faults[to_string(fault)] = entry.count;
    for (const Doubt& doubt : sensors->doubts()) summary.noticed.push_back(finding_of(doubt));
  }
  summary.traffic = robot.sent_bytes();
  if (const LocalizationNode* localization = robot.localization())
    summary.localization = {options.localize.string(), record.progress().located,
                            robot.located_after_s(), localization->compared(),
                            localization->matched()};
  if (robot.fixes() != nullptr) summary.fixes = fixes_summary(robot, record);
  if (config.budget.is_limited()) summary.held_back = held_back(robot);
  summary.process = watch->process();
  summary.seconds = watch->seconds();
  for (const MissedPeer& peer : end.missed)
    (peer.why == Absence::kSilent ? summary.lost_peers : summary.apart_peers)[peer.name] =
        peer.missed_s;
  summary.unmet_peers = end.unmet;
  summary.forged_announcements = robot.bridge().peers().ask(&PeerTable::forged_announcements);
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
  if (summary.fixes && !summary.fixes->located)
    log::warn("robot") << "not located in the frame of absolute_fixes: the poses are those of "
                          "odometry ("
                       << summary.fixes->used << " fixes used, " << summary.fixes->rejected
                       << " rejected)";
  if (!options.extend.empty() && !record.progress().located)
    log::warn("robot") << "not localised in " << options.extend.string()
                       << ": the poses of this run are those of odometry, apart from those before";
  room.release_trajectories();
  write_all(options, config, robot, record, result, results);
  if (summary.odometry && !result.interrupted &&
      (summary.odometry->divergences > 0 || summary.odometry->starts == 0)) {
    log::warn("robot") << "odometry failed: looking at the recording for the cause";
    for (Finding& found : causes_of_failed_odometry(options, config, signals))
      if (std::ranges::find(summary.noticed, found.id, &Finding::id) == summary.noticed.end())
        summary.noticed.push_back(std::move(found));
  }
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

// The estimate is relative to the rig with which the run began. A EuRoC folder keeps its own
// calibration.
void write_estimated_rig(const RobotOptions& options, const RigInput& rig, const RunRecord& record,
                         ResultWriter& results) {
  const std::optional<UncertainCalibration> found = record.calibration();
  if (!found) return;
  const CameraCalibration correction = found->calibration.composed_with(rig.correction);
  results.write(options.output / kEstimatedRig, [&](const auto& file) {
    write_file(file,
               "# Stamps and mounting of the cameras as vio.calibrate found them: for --rig\n" +
                   corrected_rig_text(rig.messages ? options.rig : "", correction));
  });
}

// The other robots of a recorded graph.
std::set<RobotId> partners_in(const RobotInput& input, RobotId self) {
  std::set<RobotId> partners;
  if (const auto* graph = std::get_if<RecordedGraph>(&input.source))
    for (const RelativePose& closure : graph->inter_closures)
      partners.insert(closure.from.robot == self ? closure.to.robot : closure.from.robot);
  return partners;
}

// Path of the MCAP record, if one is requested; a resumed run writes a new file. Throws
// std::runtime_error if the folder of the requested file does not exist.
std::optional<fs::path> record_file(const RobotOptions& options, bool continues) {
  if (!options.record) return std::nullopt;
  const bool is_named = !options.record->empty();
  if (is_named) check_output_folder(*options.record);
  const fs::path file = is_named ? *options.record : options.output / kRecord;
  if (!continues || !fs::exists(file)) return file;
  int number = 2;
  while (fs::exists(numbered(file, number))) ++number;
  return numbered(file, number);
}

std::optional<ImageSources> sources_of(const RobotOptions& options,
                                       const std::optional<PartialRig>& rig) {
  if (rig) return image_sources(rig->rig.topics, options.rig);
  if (options.dataset.empty()) return std::nullopt;
  return image_sources(options.dataset);
}

}  // namespace

int run_robot(const RobotOptions& asked, SignalWatch& signals,
              const std::function<void(Topics&)>& listen) {
  RobotOptions options = asked;
  const RobotConfig config = load_robot_config(options);
  const RigInput rig = read_rig_input(options);
  std::optional<MappingPlan> mapping = plan_mapping(
      config.mapping, config.stereo_depth, config.segmentation, sources_of(options, rig.messages));
  if (mapping && mapping->reads_depth()) mapping->depth_baseline_m = depth_baseline_m(options);
  std::optional<RobotInput> input = open_robot_input(options, config, mapping, rig, signals);
  if (!input) {
    log::info("robot") << "interrupted before the calibration was complete: no results";
    return 0;
  }
  ResultWriter results(options.fallback);
  change_output(options, results, make_output);
  log::info("robot") << "kimera_multi_robot " << built_version() << ", commit " << built_commit();
  has_urgent_work = options.is_live || !options.pace.waits;
  const bool continues =
      options.resume && input->restored_from == RestoredFrom::kFormerProcess && input->restored;
  options.record = record_file(options, continues);
  std::set<RobotId> partners = partners_in(*input, options.robot);
  Robot robot(options, config, *std::move(input), mapping, results, signals);
  if (listen) listen(robot.topics());
  log_network(config, robot.interface());
  if (mapping && mapping->sensor.labels == LabelsFrom::kImages &&
      !config.segmentation.palette.empty())
    log::warn("robot") << "segmentation.palette is not used: labels are recorded, and with them "
                          "their label_palette.csv";
  change_output(options, results, [&](const fs::path& folder) {
    remove_former(folder, continues, options.resume);
    copy_extended(options);
  });
  const auto write = [&](const char* name, const std::string& text) {
    results.write(options.output / name, [&text](const auto& file) { write_file(file, text); });
  };
  const auto write_settings = [&] {
    write("config.yaml", config.effective);
    if (mapping && !mapping->palette.classes().empty())
      write(kLabelPalette, to_csv(mapping->palette));
  };
  write_settings();
  FinalRoom room(options.output, robot.sensors() != nullptr ? robot.sensors()->listed() : 0);

  std::optional<Watch> watch;
  watch.emplace(options, config, continues, std::move(partners), robot, results);
  const RunResult result = robot.run([&] {
    (void)robot.recorder().try_with_record([&](const RunRecord& record) {
      room.grow(record.odometry().size(), record.keyframes().size());
    });
    return watch->poll();
  });
  const auto end = [&](const RunRecord& record) {
    if (!fs::exists(options.output / "config.yaml")) write_settings();  // deleted during the run
    write_estimated_rig(options, rig, record, results);
    return conclude(options, config, robot, watch, result, record, room, results, signals);
  };
  if (result.is_left_behind("recorder"))
    results.note(options.output, "what was recorded is lost with the recorder, which hangs");
  const int exit_code = result.is_left_behind("recorder") ? end(RunRecord(options.robot))
                                                          : robot.recorder().with_record(end);
  if (result.left_behind.empty()) return exit_code;
  // Hung threads use objects that a return would destroy. The process therefore ends here, after
  // the robot has left the network.
  if (!result.is_left_behind(robot.bridge().name())) robot.leave();
  drain_standard_output();
  std::_Exit(exit_code);
}

}  // namespace km
