#include "modules/loop_closure/packed_word_points.hpp"

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

// Numbers that all points of a message share.
struct Scale {
  float focal_px = 0.0F, baseline_m = 0.0F, bearing = 0.0F, inverse_depth = 0.0F;

  [[nodiscard]] bool is_possible() const {
    const auto is_up_to = [](float value, float max) { return value > 0.0F && value <= max; };
    return is_up_to(focal_px, 1e6F) && is_up_to(baseline_m, 1e3F) && is_up_to(bearing, 100.0F) &&
           is_up_to(inverse_depth, 1e4F);
  }
};

Scale scale_of(const WordPoints& points) {
  Scale scale{static_cast<float>(points.focal_px), static_cast<float>(points.baseline_m), 1e-6F,
              1e-6F};
  for (const WordPoint& point : points.points) {
    scale.bearing = std::max(scale.bearing, point.keypoint.bearing.cwiseAbs().maxCoeff());
    scale.inverse_depth = std::max(scale.inverse_depth, point.keypoint.inverse_depth);
  }
  return scale;
}

std::uint64_t bearing_steps(float value, const Scale& scale) {
  return static_cast<std::uint64_t>(
      std::lround(value / scale.bearing * static_cast<float>(kBearingSteps)) + kBearingSteps);
}

float bearing_of(std::uint64_t steps, const Scale& scale) {
  return scale.bearing * static_cast<float>(static_cast<long>(steps) - kBearingSteps) /
         static_cast<float>(kBearingSteps);
}

// Rounding must not turn a known depth into 0, which means unknown.
std::uint64_t depth_steps(float value, const Scale& scale) {
  return static_cast<std::uint64_t>(
      std::max(1L, std::lround(value / scale.inverse_depth * static_cast<float>(kDepthSteps))));
}

void write(const Keypoint& point, const Scale& scale, BitWriter& writer) {
  writer.bits(bearing_steps(point.bearing.x(), scale), kBearingBits);
  writer.bits(bearing_steps(point.bearing.y(), scale), kBearingBits);
  writer.bits(depth_steps(point.inverse_depth, scale), kDepthBits);
  writer.bits(std::min(point.octave, kMaxOctave), kOctaveBits);
}

std::optional<Keypoint> read_keypoint(const Scale& scale, BitReader& reader) {
  const auto x = reader.bits(kBearingBits), y = reader.bits(kBearingBits);
  const auto depth = reader.bits(kDepthBits), octave = reader.bits(kOctaveBits);
  if (!x || !y || !depth || !octave || *depth == 0) return std::nullopt;
  return Keypoint{.bearing = {bearing_of(*x, scale), bearing_of(*y, scale)},
                  .inverse_depth = scale.inverse_depth * static_cast<float>(*depth) /
                                   static_cast<float>(kDepthSteps),
                  .octave = static_cast<std::uint8_t>(*octave)};
}

std::optional<Scale> read_scale(BitReader& reader) {
  Scale scale;
  for (float* value : {&scale.focal_px, &scale.baseline_m, &scale.bearing, &scale.inverse_depth}) {
    const auto bits = reader.bits(32);
    if (!bits) return std::nullopt;
    *value = std::bit_cast<float>(static_cast<std::uint32_t>(*bits));
  }
  return scale.is_possible() ? std::optional(scale) : std::nullopt;
}

}  // namespace

std::vector<std::uint8_t> pack(const WordPoints& points) {
  const Scale scale = scale_of(points);
  BitWriter writer;
  for (const float value : {scale.focal_px, scale.baseline_m, scale.bearing, scale.inverse_depth})
    writer.bits(std::bit_cast<std::uint32_t>(value), 32);
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
  const std::optional<Scale> scale = read_scale(reader);
  const auto count = scale ? reader.gamma() : std::nullopt;
  if (!count || *count > kMaxWordPoints + 1) return std::nullopt;
  WordPoints result{
      static_cast<double>(scale->focal_px), static_cast<double>(scale->baseline_m), {}};
  std::uint64_t word = 0;
  for (std::uint64_t i = 1; i < *count; ++i) {
    const auto skipped = reader.gamma();
    const auto keypoint = skipped ? read_keypoint(*scale, reader) : std::nullopt;
    if (!keypoint) return std::nullopt;
    word += *skipped - 1;
    if (word > ~std::uint32_t{0}) return std::nullopt;
    result.points.push_back({*keypoint, static_cast<std::uint32_t>(word)});
  }
  return reader.ended() ? std::optional(std::move(result)) : std::nullopt;
}

}  // namespace km
