#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "runtime/dds/robot_status.hpp"

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

}  // namespace km
