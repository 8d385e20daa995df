#pragma once

#include <filesystem>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/vio/feature_tracker.hpp"

namespace km {

/// A recording with the true pose of the body at each image.
struct Recording {
  SensorRig rig;
  std::vector<SensorPacket> packets;
  std::vector<SE3> T_world_body;  ///< NaN where the truth has a gap.
};

/// Images of `folder` (see FolderLayout) from `from_s` to `to_s`, with the poses of its
/// groundtruth_tum.txt or poses.txt. `imu`: with the inertial sensor, if there is one.
Recording read_recording(const std::filesystem::path& folder, double from_s, double to_s,
                         bool imu = true);

struct TrackingRun {
  std::vector<TrackedFrame> frames;
  std::vector<TrackerStatistics> statistics;
  std::vector<double> milliseconds;  ///< Processor time of each track().
};

/// The tracker receives the rotation between images that the gyroscope measures, with its bias.
TrackingRun run_tracker(const Recording& recording, const TrackerConfig& config);

/// Median, 90th percentile and share beyond 3 px.
struct ErrorSummary {
  std::size_t count = 0;
  double median_px = 0.0;
  double p90_px = 0.0;
  double outlier_share = 0.0;
};
ErrorSummary summarize(std::vector<double> errors_px);

/// Landmarks triangulated from one stereo pair, seen `gap` images later.
struct ReprojectionErrors {
  ErrorSummary left;  ///< Under the true motion. Its error of 1 mm is 1 px of a landmark at 0.45 m.
  ErrorSummary right;
  ErrorSummary fitted_left;         ///< Under the motion that fits the landmarks best.
  double fit_translation_mm = 0.0;  ///< Median distance of that motion from the true one.
  double fit_rotation_deg = 0.0;
};
ReprojectionErrors reprojection_errors(const Recording& recording, const TrackingRun& run,
                                       std::size_t gap);

/// Distance of the right image points from their epipolar lines.
ErrorSummary epipolar_errors(const Recording& recording, const TrackingRun& run);

/// Mean share of the features of an image that are still tracked `gap` images later.
double survival(const TrackingRun& run, std::size_t gap);

}  // namespace km
