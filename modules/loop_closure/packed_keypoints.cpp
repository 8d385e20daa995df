#include "modules/loop_closure/packed_keypoints.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "modules/place_recognition/packed_bits.hpp"

namespace km {
namespace {

constexpr unsigned kBearingBits = 12, kDepthBits = 10, kOctaveBits = 3;
constexpr long kBearingSteps = (1L << (kBearingBits - 1)) - 1;
constexpr long kDepthSteps = (1L << kDepthBits) - 1;
constexpr std::uint8_t kMaxOctave = (1U << kOctaveBits) - 1;

// Numbers that all keypoints of a message share. Bearings and inverse depths are stated in shares
// of the largest one.
struct KeypointScale {
  float focal_px = 0.0F;
  float baseline_m = 0.0F;
  float bearing = 1e-6F;        // largest coordinate of a bearing
  float inverse_depth = 1e-6F;  // largest inverse depth [1/m]

  void include(const Keypoint& keypoint) {
    bearing = std::max(bearing, keypoint.bearing.cwiseAbs().maxCoeff());
    inverse_depth = std::max(inverse_depth, keypoint.inverse_depth);
  }
};

// False if a number is that of no camera: not finite, not positive, a bearing beyond 89.4 degrees,
// or a depth below 0.1 mm.
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

void write(const MatchedDescriptor& descriptor, BitWriter& writer) {
  for (const std::uint8_t byte : descriptor) writer.bits(byte, 8);
}

std::optional<MatchedDescriptor> read_descriptor(BitReader& reader) {
  MatchedDescriptor descriptor{};
  for (std::uint8_t& value : descriptor) {
    const auto byte = reader.bits(8);
    if (!byte) return std::nullopt;
    value = static_cast<std::uint8_t>(*byte);
  }
  return descriptor;
}

}  // namespace

std::vector<std::uint8_t> pack(const KeyframeFeatures& features) {
  if (features.keypoints.empty()) return {};
  KeypointScale scale{.focal_px = static_cast<float>(features.focal_px),
                      .baseline_m = static_cast<float>(features.baseline_m)};
  for (const Keypoint& keypoint : features.keypoints) scale.include(keypoint);
  BitWriter writer;
  write(scale, writer);
  writer.gamma(features.keypoints.size() + 1);
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    write(features.keypoints[i], scale, writer);
    write(features.matched[i], writer);
  }
  return writer.take();
}

std::optional<KeyframeFeatures> unpack_features(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return KeyframeFeatures();
  BitReader reader(bytes);
  const auto scale = read_scale(reader);
  const auto count = scale ? reader.gamma() : std::nullopt;
  if (!count || *count > kMaxKeypoints + 1) return std::nullopt;
  KeyframeFeatures features;
  features.focal_px = static_cast<double>(scale->focal_px);
  features.baseline_m = static_cast<double>(scale->baseline_m);
  for (std::uint64_t i = 1; i < *count; ++i) {
    const auto keypoint = read_keypoint(*scale, reader);
    const auto descriptor = keypoint ? read_descriptor(reader) : std::nullopt;
    if (!descriptor) return std::nullopt;
    features.keypoints.push_back(*keypoint);
    features.matched.push_back(*descriptor);
  }
  return reader.ended() ? std::optional(std::move(features)) : std::nullopt;
}

std::vector<std::uint8_t> pack(std::span<const MatchedDescriptor> descriptors) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(kMatchedBytes * descriptors.size());
  for (const MatchedDescriptor& descriptor : descriptors)
    bytes.insert(bytes.end(), descriptor.begin(), descriptor.end());
  return bytes;
}

std::optional<std::vector<MatchedDescriptor>> unpack_descriptors(
    std::span<const std::uint8_t> bytes) {
  if (bytes.size() % kMatchedBytes != 0 || bytes.size() > kMatchedBytes * kMaxKeypoints)
    return std::nullopt;
  std::vector<MatchedDescriptor> descriptors(bytes.size() / kMatchedBytes);
  for (std::size_t i = 0; i < descriptors.size(); ++i)
    std::ranges::copy(bytes.subspan(kMatchedBytes * i, kMatchedBytes), descriptors[i].begin());
  return descriptors;
}

std::vector<std::uint8_t> pack(const WordPoints& points) {
  KeypointScale scale{.focal_px = static_cast<float>(points.focal_px),
                      .baseline_m = static_cast<float>(points.baseline_m)};
  for (const WordPoint& point : points.points) scale.include(point.keypoint);
  BitWriter writer;
  write(scale, writer);
  writer.gamma(points.points.size() + 1);
  std::uint32_t last = 0;
  for (const WordPoint& point : points.points) {
    writer.gamma(std::uint64_t{point.word - last} + 1);
    write(point.keypoint, scale, writer);
    last = point.word;
  }
  return writer.take();
}

std::optional<WordPoints> unpack_word_points(std::span<const std::uint8_t> bytes) {
  BitReader reader(bytes);
  const auto scale = read_scale(reader);
  const auto count = scale ? reader.gamma() : std::nullopt;
  if (!count || *count > kMaxKeypoints + 1) return std::nullopt;
  WordPoints result{
      static_cast<double>(scale->focal_px), static_cast<double>(scale->baseline_m), {}};
  std::uint64_t word = 0;
  for (std::uint64_t i = 1; i < *count; ++i) {
    const auto skipped = reader.gamma();
    const auto keypoint = skipped ? read_keypoint(*scale, reader) : std::nullopt;
    if (!keypoint || !keypoint->has_depth()) return std::nullopt;
    word += *skipped - 1;
    if (word > ~std::uint32_t{0}) return std::nullopt;
    result.points.push_back({*keypoint, static_cast<std::uint32_t>(word)});
  }
  return reader.ended() ? std::optional(std::move(result)) : std::nullopt;
}

}  // namespace km
