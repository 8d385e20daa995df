#include "modules/loop_closure/packed_word_points.hpp"

#include "modules/loop_closure/packed_keypoints.hpp"
#include "modules/place_recognition/packed_bits.hpp"

namespace km {

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
  if (!count || *count > kMaxWordPoints + 1) return std::nullopt;
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
