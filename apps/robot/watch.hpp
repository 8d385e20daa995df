#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "apps/result_writer.hpp"
#include "apps/robot/assemblies/robot.hpp"
#include "apps/robot/growing_files.hpp"
#include "apps/robot/run_end.hpp"
#include "apps/robot/status.hpp"
#include "apps/robot/unmet_peers.hpp"

namespace km {

/// Work beside the modules while they run: phase, status line, traffic and memory over time. One
/// thread uses it.
class Watch {
 public:
  /// `continues`: continues the run whose results are in the folder. `partners`: robots to which
  /// closures of a recorded graph lead. `robot` and `results` outlive this.
  Watch(const RobotOptions& options, const RobotConfig& config, bool continues,
        std::set<RobotId> partners, Robot& robot, ResultWriter& results);

  /// True when the robot may leave, or must leave because another robot has its id. Called ten
  /// times a second.
  bool poll();

  /// `record` is final.
  void finish(const RunRecord& record);

  [[nodiscard]] ProcessSummary process() const { return process_csv_.summary(); }
  [[nodiscard]] double seconds() const;
  [[nodiscard]] const char* reason() const { return departure_.reason(); }
  [[nodiscard]] std::vector<MissedPeer> missed() const;
  [[nodiscard]] bool is_alone() const { return robot_.bridge().peers().list().empty(); }
  [[nodiscard]] std::map<std::string, std::string> unmet() const { return unmet_.reasons(); }

 private:
  void update_phase(double now_s, bool ended, const RunRecord& record);
  bool awaits_peers(double now_s, std::span<const RobotId> team);
  bool leave_notice_sent(double now_s);
  void log_progress(double now_s, const RunRecord& record, const TrafficSnapshot& traffic);
  void show_status(const RunRecord& record, const TrafficSnapshot& traffic);
  [[nodiscard]] std::map<RobotId, Absentees::Known> known_peers() const;
  [[nodiscard]] std::map<RobotId, Departure::Present> present_peers() const;
  void sample(double now_s);
  void write(double now_s, const TrafficSnapshot& traffic);

  Robot& robot_;
  const bool is_past_;
  std::set<RobotId> partners_;  // robots of the recorded graph that have not come yet
  bool told_ = false;           // the log names them
  const double serve_limit_s_, lease_s_;
  Departure departure_;
  Absentees absentees_;
  UnmetPeers unmet_;
  double start_s_;
  GrowingFile traffic_file_;
  TrafficCsv traffic_csv_;
  GrowingFile process_file_;
  ProcessCsv process_csv_;
  GrowingFile rounds_file_;
  RoundsCsv rounds_csv_;
  double written_s_ = 0.0;
  double logged_s_ = -1.0, sampled_s_ = -1.0;  // the first call of poll() does both
  double next_trim_s_ = 0.0;                   // at once: the start frees most of what it takes
  std::optional<double> leaving_since_s_;
  StatusLine status_line_;
};

}  // namespace km
