#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "modules/core/camera/frame.hpp"
#include "modules/core/camera/image_size.hpp"
#include "modules/core/data/keyframe.hpp"

namespace km {

/// Positions of one point in two images [px].
struct PixelPair {
  Eigen::Vector2d a = Eigen::Vector2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
};

/// Points of a left image (a) with their matches anywhere in the right image (b).
struct StereoMatches {
  std::vector<PixelPair> pairs;
};

/// Positions of a point in a left image, in a later left image, and in the right image of the
/// earlier pair [px].
struct TrackedPoint {
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right;
  double depth_m = 0.0;  ///< Depth at the first position; 0: unknown.
};

struct TrackedStep {
  Stamp from = 0, to = 0;
  std::vector<TrackedPoint> points;
};

/// Brightness, sharpness and texture of one left image.
struct ImageQuality {
  double mean_level = 0.0;       ///< Mean grey level, 0 to 255.
  double saturated_share = 0.0;  ///< Share of pixels of 250 and above.
  /// 99 % quantile of the gradients, relative to that of the image at half size. The ratio is about
  /// 1 if edges are as sharp as pixels permit, and approaches 0.5 with blur. NaN without gradients.
  double sharpness = 0.0;
  std::size_t corners = 0;  ///< Number of FAST corners at a threshold of 12.
};

/// Measurements from a part of a recording, independent of any calibration, so that calibrations
/// can be compared with them. They are from some of the images and all inertial samples.
struct SensorSample {
  ImageSize left_size, right_size;
  std::vector<StereoMatches> stereo;
  std::vector<TrackedStep> steps;
  std::vector<ImageQuality> qualities;
  std::vector<std::vector<BinaryDescriptor>>
      descriptors;  ///< ORB descriptors of each left image in `qualities`.
  std::vector<Stamp> frames;
  std::vector<ImuSample> imu;
};

/// An image with the pyramid for OpenCV's KLT tracker: window 21 px, 4 levels.
struct KltImage {
  cv::Mat image;                 ///< 8-bit grey.
  std::vector<cv::Mat> pyramid;  ///< With borders and derivatives.
};

/// Collects a SensorSample, deterministic for equal packets. Not thread-safe.
///
/// Stereo: 800 ORB features of OpenCV are matched by brute force in both directions over the whole
/// image, with a ratio test of 0.8. Stereo and image qualities use a pair every half second,
/// kMaxStereo at most. Steps: KLT tracks the 200 strongest corners forward and back (1 px), from an
/// image to the first image at least 90 ms later. There is no step if that image is more than 250
/// ms later. The corners are also tracked to the right image, starting with the shift of the
/// nearest ORB match.
class SensorSampler {
 public:
  static constexpr std::size_t kMaxStereo = 60;

  void add(const SensorPacket& packet);
  [[nodiscard]] const SensorSample& sample() const { return sample_; }

 private:
  void add_stereo(const StereoFrame& frame, const cv::Mat& left);
  void add_step(const StereoFrame& frame, const cv::Mat& left);
  void begin_step(const StereoFrame& frame, KltImage image);

  SensorSample sample_;
  // First image of a step.
  KltImage last_;
  Stamp last_stamp_ = 0;
  std::vector<cv::Point2f> corners_;
  // Positions of the corners in the right image [px].
  std::vector<std::optional<Eigen::Vector2d>> right_;
  std::vector<double> depths_m_;  // depths of the corners, 0: unknown
  Stamp last_stereo_ = 0;
};

}  // namespace km
