#pragma once

#include <cstdint>
#include <vector>

#include "modules/core/config.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Errors of stamps and lost images. Signs of drifts are random; 0 switches an error off.
struct TimingErrorConfig {
  static constexpr const char* kSection = "timing";

  double drift_ppm = 0.0;
  double jump_s = 0.0;
  double jump_every_s = 0.0;
  double camera_drift_ppm = 0.0;
  double camera_delay_s = 0.0;
  double dropped_share = 0.0;
  double dropped_run = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field("drift_ppm", drift_ppm, {0.0, 10000.0},
                  "parts per million by which the robot's clock is fast or slow");
    visitor.field("jump_s", jump_s, {0.0, 10.0}, "s, by which the robot's clock jumps ahead");
    visitor.field("jump_every_s", jump_every_s, {0.0, 36000.0},
                  "s, mean time between jumps; 0: none");
    visitor.field("camera_drift_ppm", camera_drift_ppm, {0.0, 10000.0},
                  "parts per million, the cameras' clock against the robot's");
    visitor.field("camera_delay_s", camera_delay_s, {0.0, 1.0},
                  "s, by which the stamps of images are late");
    visitor.field("dropped_share", dropped_share, {0.0, 0.9}, "share of images that are lost");
    visitor.field("dropped_run", dropped_run, {1.0, 1000.0},
                  "images, mean number that are lost in a row");
  }
};

/// The clocks of one robot: the stamps that they give to true times. Stamps ascend with time. True
/// time and all clocks agree at `start`, except for the delay of the cameras. Immutable.
class RobotClock {
 public:
  /// `end`: end of the recording; there are no jumps after it. Throws ConfigError.
  RobotClock(const TimingErrorConfig& config, Stamp start, Stamp end, std::uint64_t seed);

  /// Stamp of inertial samples and true states.
  [[nodiscard]] Stamp inertial(Stamp true_time) const;
  /// Stamp of images.
  [[nodiscard]] Stamp camera(Stamp true_time) const;
  /// True times of the jumps.
  [[nodiscard]] const std::vector<Stamp>& jumps() const { return jumps_; }
  /// Signed drifts, parts of one.
  [[nodiscard]] double drift() const { return drift_; }
  [[nodiscard]] double camera_drift() const { return camera_drift_; }

 private:
  Stamp start_ = 0;
  double drift_ = 0.0;
  double camera_drift_ = 0.0;
  Stamp jump_ = 0;
  Stamp delay_ = 0;
  std::vector<Stamp> jumps_;
};

/// `images` without those that are lost: a Markov chain with the configured share and mean run.
/// The first image is never lost. Throws ConfigError.
[[nodiscard]] std::vector<Stamp> without_dropped(const std::vector<Stamp>& images,
                                                 const TimingErrorConfig& config,
                                                 std::uint64_t seed);

}  // namespace km
