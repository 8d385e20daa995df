#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/image_size.hpp"
#include "modules/core/keyframe.hpp"
#include "modules/evaluation/images/round_trip.hpp"

namespace km {

/// One point seen in two images: where each shows it [px].
struct PixelPair {
  Eigen::Vector2d a = Eigen::Vector2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
};

/// Points of a left image (a) found in the right one (b), wherever they lie there.
struct StereoMatches {
  std::vector<PixelPair> pairs;
};

/// A point of a left image, in a later one, and in the right image of the earlier pair [px].
struct TrackedPoint {
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right;
};

struct TrackedStep {
  Stamp from = 0, to = 0;
  std::vector<TrackedPoint> points;
};

/// What one left image is like.
struct ImageLook {
  double mean_level = 0.0;       ///< Of 0 to 255.
  double saturated_share = 0.0;  ///< Pixels of 250 and above.
  /// Strongest gradients (99 %) over those of the image at half its size: about 1 where edges are
  /// as sharp as pixels allow, towards 0.5 the more they are blurred. NaN without any gradient.
  double sharpness = 0.0;
  std::size_t corners = 0;  ///< FAST, at a threshold of 12.
};

/// What a part of a recording shows, free of any calibration: so that calibrations can be held
/// against it. An excerpt: some of the images, all of the inertial samples.
struct SensorSample {
  ImageSize left_size, right_size;
  std::vector<StereoMatches> stereo;
  std::vector<TrackedStep> steps;
  std::vector<ImageLook> looks;
  std::vector<std::vector<OrbDescriptor>> descriptors;  ///< Of the images of `stereo`.
  std::vector<Stamp> frames;
  std::vector<ImuSample> imu;
};

/// Collects a SensorSample, deterministic for equal packets. Not thread-safe.
///
/// Stereo: OpenCV's ORB, 800 features, brute force both ways over the whole image with a ratio test
/// of 0.8, of a pair every half second, kMaxStereo at most; looks likewise. Steps: the 200
/// strongest corners, followed by KLT and back (1 px), from an image to the first at least 90 ms
/// later, unless that is more than 250 ms; and to the right image, from where the nearest ORB match
/// went.
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
  // What a step begins in.
  KltImage last_;
  Stamp last_stamp_ = 0;
  std::vector<cv::Point2f> corners_;
  std::vector<std::optional<Eigen::Vector2d>> right_;  // of the corners
  Stamp last_stereo_ = 0;
};

}  // namespace km
