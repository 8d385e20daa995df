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
#include "runtime/dds/robot_status.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// Decides how far a robot is with its run, and when it may leave its team.
///
/// A robot whose input has ended goes on serving its team: it leaves when it and every robot of the
/// team, heard or not, have been settled for `settle_s`, or `serve_limit_s` after its input ended.
/// Pure: time comes in [s], any origin.
class Departure {
 public:
  Departure(double settle_s, double serve_limit_s)
      : settle_s_(settle_s), serve_limit_s_(serve_limit_s) {}

  /// A robot that is heard, as it tells of itself.
  struct Present {
    RobotPhase phase = RobotPhase::kRunning;
    std::uint8_t settled_links = 0;  ///< See RobotStatus.
  };
  struct Inputs {
    bool input_ended = false;    ///< And what was in flight has been processed.
    bool graph_settled = false;  ///< The optimiser has nothing left to do.
    std::uint64_t activity = 0;  ///< Changes whenever a module has done something new.
    std::span<const Present> present_peers = {};
    std::size_t unheard = 0;  ///< Robots of the team that only others hear.
  };

  /// Takes the state at `now_s`; what to tell the others.
  Present update(double now_s, const Inputs& inputs);

  /// Why the robot may leave, or nullptr if it should stay; as of the last update().
  [[nodiscard]] const char* reason() const { return reason_; }

 private:
  double settle_s_;
  double serve_limit_s_;
  std::optional<double> ended_s_;
  std::optional<double> all_settled_s_;  // since when, without a break
  std::uint64_t activity_ = 0;
  double active_s_ = 0.0;  // last change of activity
  const char* reason_ = nullptr;
};

/// Why a robot ends without another one of its team. kSilent: it went silent without a word and has
/// not come back: out of reach, or dead. kApart: it is heard, but they are not in one frame.
enum class Absence { kSilent, kApart };

struct MissedPeer {
  std::string name;
  Absence why = Absence::kSilent;
  double missed_s = 0.0;  ///< For how long, at the end.
};

/// Keeps since when a robot misses others of its team. Pure: time comes in [s], any origin.
class Absentees {
 public:
  /// kLeft: it said good-bye. kTold: only others have heard it.
  enum class Contact { kHeard, kSilent, kLeft, kTold };
  struct Known {
    std::string name;
    Contact contact = Contact::kHeard;
  };

  /// `members`: the robots in one frame with this one, itself included, whether it hears them or
  /// others do.
  void update(double now_s, const std::map<RobotId, Known>& known,
              std::span<const RobotId> members);

  /// As of the last update(), ascending by id. Former members that were never heard are told once
  /// they have been missed for `hearsay_s`: they may have left in order, as only others know.
  [[nodiscard]] std::vector<MissedPeer> missed(double hearsay_s) const;

 private:
  struct Missed {
    std::string name;
    Absence why = Absence::kSilent;
    bool hearsay = false;
    double since_s = 0.0;
  };
  void miss(RobotId robot, const Missed& missed, std::map<RobotId, Missed>& now) const;

  double now_s_ = 0.0;
  std::set<RobotId> ever_members_;
  std::map<RobotId, Missed> missed_;
};

/// What became of the images of a recording.
struct ImageCounts {
  std::size_t listed = 0;     ///< Stereo pairs of the part that was to be played.
  std::size_t read = 0;       ///< Handed to odometry.
  std::size_t skipped = 0;    ///< Left out because processors were short.
  std::size_t with_pose = 0;  ///< That odometry estimated a pose of.
};

/// How a run came to its end.
struct RunEnd {
  RobotId robot = 0;
  RunResult result;
  bool id_taken = false;                   ///< Another living robot had the same id first.
  const char* departure = nullptr;         ///< Why the robot left its team, if it did.
  std::optional<ImageCounts> images = {};  ///< Absent for a robot without sensors.
  bool is_live = false;                    ///< A signal is the usual end of live sensors.
  /// Why each result that could not be written is lost, by file.
  std::map<std::string, std::string> lost_results = {};
  std::vector<MissedPeer> missed = {};  ///< Whom the robot left without.
};

/// What the robot says of its run, to people and to the process that started it.
struct Verdict {
  int exit_code = 0;
  std::string reason;  ///< One line.
};

/// 5 if a module hung. 3 if one failed, or another robot claimed the id: whose data the team then
/// used is anybody's guess. 1 if the run came to its end and not one image has a pose, or live
/// sensors gave no image. 4 if results could not be written. 0 otherwise. A robot that left without
/// others of its team says whom, why, and for how long it had missed them.
[[nodiscard]] Verdict verdict_of(const RunEnd& end);

/// "2910 of 2912 images have a pose".
[[nodiscard]] std::string to_string(const ImageCounts& images);

}  // namespace km
