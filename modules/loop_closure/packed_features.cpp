#include "modules/loop_closure/packed_features.hpp"

#include <algorithm>

#include "modules/loop_closure/matching.hpp"
#include "modules/loop_closure/packed_keypoints.hpp"

namespace km {
namespace {

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

}  // namespace km
