#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "runtime/dds/robot_status.hpp"

namespace km {

/// Decides how far a robot is with its run, and when it may leave its team.
///
/// A robot whose input has ended goes on serving its peers: it leaves when it and every present
/// peer have been settled for `settle_s`, or `serve_limit_s` after its input ended. Pure: time
/// comes in [s], any origin.
class Departure {
 public:
  Departure(double settle_s, double serve_limit_s)
      : settle_s_(settle_s), serve_limit_s_(serve_limit_s) {}

  struct Inputs {
    bool input_ended = false;    ///< And what was in flight has been processed.
    bool graph_settled = false;  ///< The optimiser has nothing left to do.
    std::uint64_t activity = 0;  ///< Changes whenever a module has done something new.
    std::span<const RobotPhase> present_peers = {};
  };

  /// Takes the state at `now_s`; the phase to tell the others.
  RobotPhase update(double now_s, const Inputs& inputs);

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
