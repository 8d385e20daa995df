#pragma once

#include <optional>

#include "modules/core/keyframe.hpp"
#include "modules/place_recognition/packed_bits.hpp"

namespace km {

/// Numbers that all keypoints of a message share. Bearings and inverse depths are stated in shares
/// of the largest one.
struct KeypointScale {
  float focal_px = 0.0F;
  float baseline_m = 0.0F;
  float bearing = 1e-6F;        ///< Largest coordinate of a bearing.
  float inverse_depth = 1e-6F;  ///< Largest inverse depth [1/m].

  /// Extends the largest values to those of `keypoint`.
  void include(const Keypoint& keypoint);
};

/// Writes `scale` as four floats.
void write(const KeypointScale& scale, BitWriter& writer);

/// Inverse of write(). nullopt if the bytes end, or if a number is that of no camera: not finite,
/// not positive, a bearing beyond 89.4 degrees, or a depth below 0.1 mm.
[[nodiscard]] std::optional<KeypointScale> read_scale(BitReader& reader);

/// Writes `keypoint` in 37 bits: 12 for each axis of its bearing, 10 for its inverse depth, and 3
/// for its octave. In an image 752 pixels wide, bearings are rounded by less than 0.2 px. Inverse
/// depths are rounded by less than a thousandth of the largest one: with 128 px as the largest
/// disparity, by 0.06 px.
void write(const Keypoint& keypoint, const KeypointScale& scale, BitWriter& writer);

/// Inverse of write(); nullopt if the bytes end.
[[nodiscard]] std::optional<Keypoint> read_keypoint(const KeypointScale& scale, BitReader& reader);

}  // namespace km
