#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// Origin of absolute fixes.
enum class FixSource {
  kNone,
  kGnss,           ///< Latitude, longitude and altitude in WGS 84.
  kMotionCapture,  ///< Positions in a frame with z up.
};

inline constexpr Choice<FixSource> kFixSources[] = {{"none", FixSource::kNone},
                                                    {"gnss", FixSource::kGnss},
                                                    {"motion_capture", FixSource::kMotionCapture}};

/// Positions of the robot in an absolute frame.
struct AbsoluteFixesConfig {
  static constexpr const char* kSection = "absolute_fixes";

  FixSource source = FixSource::kNone;
  std::string topic;
  std::string live_type;
  std::filesystem::path file;
  std::vector<double> datum = {};
  std::vector<double> lever_arm_m = {0.0, 0.0, 0.0};
  std::optional<double> sigma_m = {};
  std::optional<double> correlation_s = {};
  double min_sigma_m = 0.01;
  double max_sigma_m = 20.0;

  // The autocorrelation of a single-frequency receiver at rest bends at about one minute
  // (Wilson, GPS Horizontal Position Accuracy, 2006).
  [[nodiscard]] double used_correlation_s() const {
    return correlation_s.value_or(source == FixSource::kGnss ? 60.0 : 0.0);
  }
  [[nodiscard]] bool is_on() const { return source != FixSource::kNone; }

  void visit_fields(auto& visitor) {
    visitor.field("source", source, kFixSources,
                  "positions that place the robots in an absolute frame: gnss in east, north, up "
                  "about the datum; motion_capture in its frame, whose z must be up");
    visitor.field("topic", topic,
                  "topic of the recording or of --live: sensor_msgs/NavSatFix for gnss; "
                  "geometry_msgs/PoseStamped, PoseWithCovarianceStamped or TransformStamped for "
                  "motion_capture");
    visitor.field("live_type", live_type,
                  "type of the topic with --live and motion_capture, for example "
                  "geometry_msgs/msg/PoseStamped");
    visitor.field("file", file, Input{false},
                  "in place of a topic: rows of a stamp and latitude, longitude [deg] and altitude "
                  "[m], or x, y, z [m]; stamps in ns in a .csv file (EuRoC), in s elsewhere (TUM)");
    visitor.field("datum", datum, Bounds<double>{-1e5, 1e5},
                  "[deg, deg, m] gnss: latitude, longitude and altitude above the ellipsoid of the "
                  "origin; equal on all robots of a team; empty: the first fix, for a robot alone");
    visitor.field("lever_arm_m", lever_arm_m, Bounds<double>{-100.0, 100.0},
                  "[m] x, y, z of the antenna or marker in the body frame (inertial sensor)");
    visitor.field("sigma_m", sigma_m, Bounds<double>{1e-3, 100.0},
                  "[m] standard deviation on each axis of a fix that states none; none: 3 for "
                  "gnss, 0.02 for motion_capture");
    visitor.field(
        "correlation_s", correlation_s, Bounds<double>{0.0, 3600.0},
        "[s] correlation time of the errors of fixes: fixes that are closer in time weigh "
        "little more than one; none: 60 for gnss, 0 for motion_capture; 0 suits a "
        "receiver with corrections (RTK)");
    visitor.field("min_sigma_m", min_sigma_m, {1e-3, 100.0},
                  "[m] smaller standard deviations are increased to this; increase it if most "
                  "fixes are rejected");
    visitor.field("max_sigma_m", max_sigma_m, {1e-3, 1e4},
                  "[m] fixes with a larger standard deviation are not used");
  }
};

}  // namespace km
