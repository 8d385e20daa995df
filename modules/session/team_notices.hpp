#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/robust/closure_noise.hpp"
#include "modules/robust/odometry_breaks.hpp"
#include "modules/robust/odometry_noise.hpp"
#include "modules/session/frame_ties.hpp"

namespace km {

/// Messages for a person on the state of the team. A state is reported once, and again only if it
/// has changed notably. Not thread-safe.
class TeamNotices {
 public:
  explicit TeamNotices(RobotId self) : self_(self) {}

  void add(std::string notice) { notices_.push_back(std::move(notice)); }
  /// Counts a refused input, and reports the first, second, fourth, ... of equal reason. Always
  /// returns false.
  bool refuse(const std::string& reason);
  /// Reports odometry of this robot that is noisier than it claims.
  void odometry(const OdometryNoise& noise);
  /// Reports wrong steps of odometry of this robot.
  void breaks(std::span<const OdometryBreak> breaks);
  /// Reports pairs of robots whose closures are noisier than those of the team.
  void closures(const ClosureNoiseRecord& noise);
  /// Reports a robot that is located in another datum than this robot.
  void other_datum(RobotId robot);
  /// Reports a message of the solver that is too large to be sent.
  void message(std::size_t bytes);
  /// Reports robots whose pose relative to this robot is uncertain, or certain again.
  void ties(const FrameTies& ties);

  [[nodiscard]] std::vector<std::string> take() { return std::exchange(notices_, {}); }
  /// States that are certain again.
  [[nodiscard]] std::vector<std::string> take_news() { return std::exchange(news_, {}); }
  /// Number of refusals by reason.
  [[nodiscard]] const std::map<std::string, std::size_t>& refused() const { return refused_; }

 private:
  RobotId self_;
  std::vector<std::string> notices_, news_;
  std::map<std::string, std::size_t> refused_;
  double odometry_noise_ = 0.0;                // in the last notice
  std::set<std::size_t> breaks_;               // steps in a notice
  std::map<RobotId, double> closure_factors_;  // in the last notice, by peer
  FrameTies ties_;                             // in the last notice
  std::set<RobotId> other_datum_;              // in a notice
  std::size_t largest_message_ = 0;            // in the last notice
};

}  // namespace km
