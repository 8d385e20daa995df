#pragma once

#include <cstdint>
#include <string>

#include "modules/core/ids.hpp"

namespace km {

/// kFinished: its input has ended. kSettled: and its graph has, as far as it knows. kLeaving: about
/// to end.
enum class RobotPhase { kRunning, kFinished, kSettled, kLeaving };

/// "running", "finished", "settled", "leaving".
const char* to_string(RobotPhase phase);

/// What a robot tells the others about itself, a few times a second.
struct RobotStatus {
  RobotId robot = 0;
  std::string name;
  RobotPhase phase = RobotPhase::kRunning;
  double dataset_time_s = 0.0;  ///< Since the start of its input.
  std::uint32_t keyframes = 0;
  /// Robots fewer links away than this have settled; 0: not even this one. It grows by one with
  /// what each neighbour tells of its own, so that also far ones are waited for.
  std::uint8_t settled_links = 0;
};

/// As far as anybody asks.
inline constexpr std::uint8_t kManyLinks = 255;

}  // namespace km
