#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Bytes of the descriptor of a keypoint. Messages, journals and vocabularies contain as many.
inline constexpr std::size_t kDescriptorBytes = 32;

/// Binary descriptor of a keypoint by ORB: see make_keypoint_extractor(). Its word is found by it.
using BinaryDescriptor = std::array<std::uint8_t, kDescriptorBytes>;

/// Bytes of the descriptor by which keypoints of two keyframes are matched.
inline constexpr std::size_t kMatchedBytes = 12;

/// Descriptor by which keypoints of two keyframes are matched: the first tests of ORB (see
/// orb_bits()), or numbers of a network in 4 bits each (see KeypointDescriber).
using MatchedDescriptor = std::array<std::uint8_t, kMatchedBytes>;

/// An image point of the left camera with its depth if stereo measured it.
struct Keypoint {
  Eigen::Vector2f bearing = Eigen::Vector2f::Zero();  ///< On z = 1 of the left camera, undistorted.
  float inverse_depth = 0.0F;  ///< 1/z in the left camera [1/m]; 0: depth unknown.
  std::uint8_t octave = 0;     ///< Level of the scale pyramid (factor 1.2): noise 1.2^octave px.

  [[nodiscard]] bool has_depth() const { return inverse_depth > 0.0F; }
};

/// Features with which another robot aligns itself to a keyframe: points, descriptors, and the
/// properties of the rig that determine their noise. An own keyframe has as many descriptors as
/// keypoints, and those of a network or none in `matched`. A keyframe of a peer has only those in
/// `matched`. See matched_by().
struct KeyframeFeatures {
  SE3 T_body_cam = SE3::Identity();  ///< Pose of the left camera.
  /// Covariance of the error delta of T_body_cam = delta * (true one), absent from messages.
  Matrix6 mounting = Matrix6::Zero();
  DepthSource depth_source = DepthSource::kRightImage;  ///< Absent from messages.
  double focal_px = 0.0;
  double baseline_m = 0.0;
  std::vector<Keypoint> keypoints;
  std::vector<BinaryDescriptor> descriptors;
  std::vector<MatchedDescriptor> matched;
  std::uint16_t network = 0;  ///< Identity of the network of `matched`; 0: ORB.
};

/// Pose of a keyframe in its robot's odometry frame with the covariance accumulated along the
/// odometry since that robot's first keyframe (see between_on_chain()).
struct OdometryPose {
  KeyframeId id;
  SE3 T_odom_kf = SE3::Identity();
  Matrix6 covariance = Matrix6::Zero();
};

/// A keyframe with the data for place recognition and verification.
struct Keyframe {
  OdometryPose odometry;
  Stamp stamp = 0;
  KeyframeFeatures features;
};

}  // namespace km
