#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "modules/core/ids.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// Decides how far a robot is with its run, and when it may leave its team.
///
/// A robot whose input has ended continues to serve its team. It leaves when it and every robot of
/// the team, received or not, have been settled for `settle_s`, or `serve_limit_s` after its input
/// ended. It is not settled while it awaits peers. Pure: time is an argument [s], with any origin.
class Departure {
 public:
  Departure(double settle_s, double serve_limit_s)
      : settle_s_(settle_s), serve_limit_s_(serve_limit_s) {}

  /// Progress that a present robot reports in its status.
  struct Present {
    RobotPhase phase = RobotPhase::kRunning;
    std::uint8_t settled_links = 0;  ///< See RobotStatus.
  };
  struct Inputs {
    bool input_ended = false;    ///< The input and all messages made from it have been processed.
    bool graph_settled = false;  ///< The optimiser has nothing left to do.
    std::uint64_t activity = 0;  ///< Changes whenever a module has done new work.
    std::span<const Present> present_peers = {};
    std::size_t not_received = 0;  ///< Number of members that only other robots receive.
    bool awaits_peers = false;     ///< The robot has measurements of robots that it has never met.
  };

  /// Takes the state at `now_s` and returns the progress to publish.
  Present update(double now_s, const Inputs& inputs);

  /// Why the robot may leave, or nullptr if it should stay; as of the last update().
  [[nodiscard]] const char* reason() const { return reason_; }

 private:
  double settle_s_;
  double serve_limit_s_;
  std::optional<double> ended_s_;
  std::optional<double> all_settled_s_;  // begin of the uninterrupted time in which all are settled
  std::uint64_t activity_ = 0;
  double active_s_ = 0.0;  // last change of activity
  const char* reason_ = nullptr;
};

/// Reason why a robot ends without another one of its team. kSilent: the other robot went silent
/// without a leave message and did not return. kApart: the other robot is received, but has no
/// frame in common with this robot.
enum class Absence { kSilent, kApart };

struct MissedPeer {
  std::string name;
  Absence why = Absence::kSilent;
  double missed_s = 0.0;  ///< Time without this robot, up to the end of the run.
};

/// Records the robots of the team that this robot misses, and the time since then. Pure: time is an
/// argument [s], with any origin.
class Absentees {
 public:
  struct Known {
    std::string name;
    PeerState state = PeerState::kAlive;
  };

  /// `members`: all robots in one frame with this one, itself included, received directly or only
  /// by others.
  void update(double now_s, const std::map<RobotId, Known>& known,
              std::span<const RobotId> members);

  /// True if the robot is received, or has been silent for less than `patience_s` and has not left.
  [[nodiscard]] bool is_present(RobotId robot, double patience_s) const;

  /// Missed robots as of the last update(), ascending by id. A former member that this robot never
  /// received is listed only after it has been missed for `second_hand_s`, because it may have sent
  /// its leave message to other robots.
  [[nodiscard]] std::vector<MissedPeer> missed(double second_hand_s) const;

 private:
  struct Missed {
    std::string name;
    Absence why = Absence::kSilent;
    bool second_hand = false;
    double since_s = 0.0;
  };
  void miss(RobotId robot, const Missed& missed, std::map<RobotId, Missed>& now) const;

  double now_s_ = 0.0;
  std::set<RobotId> ever_members_;
  std::map<RobotId, Missed> missed_;
  std::map<RobotId, double> received_s_;  // when last, of robots that have not left
};

/// Number of images of a recording by their use.
struct ImageCounts {
  std::size_t listed = 0;     ///< Stereo pairs of the part that was to be played.
  std::size_t read = 0;       ///< Passed to odometry.
  std::size_t skipped = 0;    ///< Left out because processors were short.
  std::size_t with_pose = 0;  ///< Images with an estimated pose.
};

/// Outcome of a run.
struct RunEnd {
  RobotId robot = 0;
  RunResult result;
  bool id_taken = false;                   ///< Another robot had the same id first, or may have.
  const char* departure = nullptr;         ///< Reason why the robot left its team, if it did.
  std::optional<ImageCounts> images = {};  ///< Absent for a robot without sensors.
  std::string odometry_fault = {};         ///< Error of the input for which odometry failed.
  bool is_live = false;                    ///< With live sensors, a signal is the usual end.
  /// By file, the reason why a result could not be written.
  std::map<std::string, std::string> lost_results = {};
  bool is_alone = false;                ///< It has never met another robot.
  std::vector<MissedPeer> missed = {};  ///< Robots of the team that were missing at the end.
  std::map<std::string, std::string> unmet = {};  ///< At the end: see PeerTable::unmet().
};

/// Exit code and reason, for people and for the process that started the robot.
struct Verdict {
  int exit_code = 0;
  std::string reason;  ///< Reason in one line.
};

/// 5 if a module hung. 3 if a module failed, or another robot claimed the id: the team may then
/// have used the data of either. 1 if the run ended and no image has a pose, odometry failed for a
/// fault of the input, or live sensors gave no image. 4 if results could not be written. 0
/// otherwise. If others of the team were missing, the reason names them, why, and for how long.
[[nodiscard]] Verdict verdict_of(const RunEnd& end);

/// "2910 of 2912 images have a pose".
[[nodiscard]] std::string to_string(const ImageCounts& images);

}  // namespace km
