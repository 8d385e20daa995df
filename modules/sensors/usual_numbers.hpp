#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"

namespace km {

/// Numbers of sensors and calibrations that drivers are known to confuse.
enum class UsualNumber {
  kBaseline_m,
  kLever_m,
  kImageRate_hz,
  kImuRate_hz,
  kGravity_mps2,
  kDepth_m,
  kDepthShare,
  kDepthPower
};

/// A value outside the range that robots have.
struct Doubt {
  std::string id;    ///< Stable, for programs: "stereo.baseline".
  std::string what;  ///< "a baseline of 11.01 m, usually 0.01 to 1 m: 0.1101 m if in centimetres".
  std::string means;
  std::string to_do;
  bool is_explained = false;  ///< A known confusion makes an impossible value usual.
};

/// The doubt about a value, from a table with the usual range and the usual confusions of each
/// number; nullopt for usual values and NaN.
[[nodiscard]] std::optional<Doubt> doubt(UsualNumber number, double value);

/// The doubt about a rate, from its mean and the median of the intervals. Microseconds in a field
/// of nanoseconds, beside one of seconds, shorten most intervals and keep the mean.
[[nodiscard]] std::optional<Doubt> rate_doubt(UsualNumber number, double rate_hz, double median_s);

/// Doubts about the baseline and the position of the left camera on the body.
[[nodiscard]] std::vector<Doubt> rig_doubts(const StereoRig& rig);

/// Median norm of the accelerations [m/s^2]; NaN without samples.
[[nodiscard]] double median_acceleration(const std::vector<ImuSample>& samples);

/// The doubt about the accelerations, also if they are those of the gyroscope.
[[nodiscard]] std::optional<Doubt> gravity_doubt(const std::vector<ImuSample>& samples);

/// Judges rates, accelerations and depths of the first packets of a source.
class FirstPackets {
 public:
  /// The doubts when kFrames frames have been added, once; empty before and afterwards. `camera` is
  /// that of the depth images.
  [[nodiscard]] std::vector<Doubt> add(const SensorPacket& packet, const Camera& camera);

  static constexpr std::size_t kFrames = 30;

 private:
  void add_depth(const DepthImage& depth, const Camera& camera);

  std::vector<Stamp> frames_;
  std::vector<ImuSample> samples_;
  std::vector<double> depths_m_;  // at some pixels, 0: not measured
  std::vector<double> powers_;    // powers of planar patches, see depth_power()
};

}  // namespace km
