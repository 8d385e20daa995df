#include "modules/loop_closure/packed_keypoints.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace km {
namespace {

constexpr unsigned kBearingBits = 12, kDepthBits = 10, kOctaveBits = 3;
constexpr long kBearingSteps = (1L << (kBearingBits - 1)) - 1;
constexpr long kDepthSteps = (1L << kDepthBits) - 1;
constexpr std::uint8_t kMaxOctave = (1U << kOctaveBits) - 1;

bool is_possible(const KeypointScale& scale) {
  const auto is_up_to = [](float value, float max) { return value > 0.0F && value <= max; };
  return is_up_to(scale.focal_px, 1e6F) && is_up_to(scale.baseline_m, 1e3F) &&
         is_up_to(scale.bearing, 100.0F) && is_up_to(scale.inverse_depth, 1e4F);
}

std::uint64_t bearing_steps(float value, const KeypointScale& scale) {
  return static_cast<std::uint64_t>(
      std::lround(value / scale.bearing * static_cast<float>(kBearingSteps)) + kBearingSteps);
}

float bearing_of(std::uint64_t steps, const KeypointScale& scale) {
  return scale.bearing * static_cast<float>(static_cast<long>(steps) - kBearingSteps) /
         static_cast<float>(kBearingSteps);
}

// 0 is an unknown depth. Rounding must not turn a known depth into it.
std::uint64_t depth_steps(const Keypoint& keypoint, const KeypointScale& scale) {
  if (!keypoint.has_depth()) return 0;
  return static_cast<std::uint64_t>(std::max(
      1L,
      std::lround(keypoint.inverse_depth / scale.inverse_depth * static_cast<float>(kDepthSteps))));
}

}  // namespace

void KeypointScale::include(const Keypoint& keypoint) {
  bearing = std::max(bearing, keypoint.bearing.cwiseAbs().maxCoeff());
  inverse_depth = std::max(inverse_depth, keypoint.inverse_depth);
}

void write(const KeypointScale& scale, BitWriter& writer) {
  for (const float value : {scale.focal_px, scale.baseline_m, scale.bearing, scale.inverse_depth})
    writer.bits(std::bit_cast<std::uint32_t>(value), 32);
}

std::optional<KeypointScale> read_scale(BitReader& reader) {
  KeypointScale scale;
  for (float* value : {&scale.focal_px, &scale.baseline_m, &scale.bearing, &scale.inverse_depth}) {
    const auto bits = reader.bits(32);
    if (!bits) return std::nullopt;
    *value = std::bit_cast<float>(static_cast<std::uint32_t>(*bits));
  }
  return is_possible(scale) ? std::optional(scale) : std::nullopt;
}

void write(const Keypoint& keypoint, const KeypointScale& scale, BitWriter& writer) {
  writer.bits(bearing_steps(keypoint.bearing.x(), scale), kBearingBits);
  writer.bits(bearing_steps(keypoint.bearing.y(), scale), kBearingBits);
  writer.bits(depth_steps(keypoint, scale), kDepthBits);
  writer.bits(std::min(keypoint.octave, kMaxOctave), kOctaveBits);
}

std::optional<Keypoint> read_keypoint(const KeypointScale& scale, BitReader& reader) {
  const auto x = reader.bits(kBearingBits), y = reader.bits(kBearingBits);
  const auto depth = reader.bits(kDepthBits), octave = reader.bits(kOctaveBits);
  if (!x || !y || !depth || !octave) return std::nullopt;
  return Keypoint{.bearing = {bearing_of(*x, scale), bearing_of(*y, scale)},
                  .inverse_depth = scale.inverse_depth * static_cast<float>(*depth) /
                                   static_cast<float>(kDepthSteps),
                  .octave = static_cast<std::uint8_t>(*octave)};
}

}  // namespace km
