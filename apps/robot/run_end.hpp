#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
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

/// A robot that went silent without a word and has not come back: out of reach, or dead.
struct LostPeer {
  std::string name;
  double silent_s = 0.0;  ///< At the end.
};

/// Keeps since when robots are silent. Pure: time comes in [s], any origin.
class SilentPeers {
 public:
  /// The names of those that are silent at `now_s`; of the others nothing is kept.
  void update(double now_s, const std::map<RobotId, std::string>& silent);

  /// All as of the last update(), ascending by id, but those that `reached` names: others hear
  /// them.
  [[nodiscard]] std::vector<LostPeer> lost(std::span<const RobotId> reached) const;

 private:
  struct Silence {
    std::string name;
    double since_s = 0.0;
  };
  double now_s_ = 0.0;
  std::map<RobotId, Silence> silent_;
};

/// What became of the images of a recording.
struct ImageCounts {
  std::size_t listed = 0;     ///< Stereo pairs of the part that was to be played.
  std::size_t read = 0;       ///< Handed to odometry.
  std::size_t skipped = 0;    ///< Given up because odometry lagged behind the rate.
  std::size_t with_pose = 0;  ///< That odometry estimated a pose of.
};

/// How a run came to its end.
struct RunEnd {
  RobotId robot = 0;
  RunResult result;
  bool id_taken = false;                   ///< Another living robot had the same id first.
  const char* departure = nullptr;         ///< Why the robot left its team, if it did.
  std::optional<ImageCounts> images = {};  ///< Absent for a robot without sensors.
  /// Why each result that could not be written is lost, by file.
  std::map<std::string, std::string> lost_results = {};
  std::vector<LostPeer> lost_peers = {};  ///< Robots of the team that were lost at the end.
};

/// What the robot says of its run, to people and to the process that started it.
struct Verdict {
  int exit_code = 0;
  std::string reason;  ///< One line.
};

/// 5 if a module hung. 3 if one failed, or another robot claimed the id: whose data the team then
/// used is anybody's guess. 1 if the run came to its end and not one image has a pose. 4 if results
/// could not be written. 0 otherwise. A robot that left while others were lost says whom, and for
/// how long they had been silent.
[[nodiscard]] Verdict verdict_of(const RunEnd& end);

/// "2910 of 2912 images have a pose".
[[nodiscard]] std::string to_string(const ImageCounts& images);

}  // namespace km
