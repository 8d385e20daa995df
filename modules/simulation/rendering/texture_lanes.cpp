#include "modules/simulation/rendering/texture_lanes.hpp"

#include <algorithm>
#include <bit>

namespace km {
namespace {

// Coordinates on a tile in units of 2^-30: what is beyond wraps.
constexpr int kTileBits = 30;
constexpr std::uint32_t kTileMask = (1U << kTileBits) - 1U;
constexpr int kWeightBits = 16;  // of the way from a texel to the next

// One texture per lane.
struct TextureLanes {
  std::array<const std::uint32_t*, kLanes> quads;
  IntLanes log_size;
  Lanes scale;
  Lanes per_m;
};

struct LevelBlend {
  IntLanes fine, coarse;
  Lanes share;  // of the coarse one
};

TextureLanes base_textures(const SurfacePoints& points) {
  TextureLanes textures;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const ShadingMaterial& material = *points.material[i];
    textures.quads[i] = material.base_gray.quads;
    textures.log_size[i] = material.base_gray.log_size;
    textures.scale[i] = material.base_gray.scale;
    textures.per_m[i] = material.base_per_m;
  }
  return textures;
}

TextureLanes detail_textures(const SurfacePoints& points) {
  TextureLanes textures;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const ShadingMaterial& material = *points.material[i];
    textures.quads[i] = material.detail_gray.quads;
    textures.log_size[i] = material.detail_gray.log_size;
    textures.scale[i] = material.detail_gray.scale;
    textures.per_m[i] = material.detail_per_m;
  }
  return textures;
}

// As Texture does it: between two levels the blend is linear in the footprint.
void blend_levels(const TextureLanes& textures, const Taps& taps, LevelBlend& blend) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto size = std::bit_cast<float>((127 + textures.log_size[i]) << 23);
    const float texels = taps.width_m[i] * textures.per_m[i] * size;
    const auto bits = std::bit_cast<std::int32_t>(texels);
    const std::int32_t exponent = (bits >> 23) - 127;  // floor(log2(texels))
    const auto mantissa = std::bit_cast<float>((bits & 0x007FFFFF) | 0x3F800000);  // 1 to 2
    const bool between = exponent >= 0 && exponent < textures.log_size[i];
    blend.fine[i] = std::clamp(exponent, 0, textures.log_size[i]);
    blend.coarse[i] = blend.fine[i] + (between ? 1 : 0);
    blend.share[i] = between ? mantissa - 1.0F : 0.0F;
  }
}

// Fraction of a tile, in units of 2^-30.
std::uint32_t tile_point(float tiles) {
  const float fraction = tiles - static_cast<float>(static_cast<std::int32_t>(tiles));
  return static_cast<std::uint32_t>(
      static_cast<std::int32_t>(fraction * static_cast<float>(1U << kTileBits)));
}

// Adds weight * the bilinear lookup in one level, in units of 2^-16 of the storage's step.
void add_level(const TextureLanes& textures, const IntLanes& level, const BitLanes& u,
               const BitLanes& v, const Lanes& weight, Lanes& sum) {
  BitLanes index;
  BitLanes quad;
  IntLanes x;
  IntLanes y;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto log_n = static_cast<std::uint32_t>(textures.log_size[i] - level[i]);
    const std::uint32_t half_texel = 1U << (kTileBits - 1) >> log_n;
    const std::uint32_t at_u = (u[i] - half_texel) & kTileMask;
    const std::uint32_t at_v = (v[i] - half_texel) & kTileMask;
    const std::uint32_t column = at_u >> (kTileBits - log_n);
    const std::uint32_t row = at_v >> (kTileBits - log_n);
    x[i] = static_cast<std::int32_t>((at_u << log_n & kTileMask) >> (kTileBits - kWeightBits));
    y[i] = static_cast<std::int32_t>((at_v << log_n & kTileMask) >> (kTileBits - kWeightBits));
    // The levels before this one: a sum of powers of four, (4^k - 1) / 3 each.
    constexpr std::uint32_t kThird = 0x55555555U;
    const std::uint32_t begin =
        (kThird >> (30 - 2 * textures.log_size[i])) - (kThird >> (30U - 2U * log_n));
    index[i] = begin + (row << log_n) + column;
  }
  for (std::size_t i = 0; i < kLanes; ++i) quad[i] = textures.quads[i][index[i]];
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto byte = [&](int k) { return static_cast<std::int32_t>(quad[i] >> (8 * k) & 0xFFU); };
    const std::int32_t low = (byte(0) << kWeightBits) + x[i] * (byte(1) - byte(0));
    const std::int32_t high = (byte(2) << kWeightBits) + x[i] * (byte(3) - byte(2));
    constexpr float kUnit = 1.0F / (1U << kWeightBits);
    sum[i] += weight[i] * (static_cast<float>(low) +
                           kUnit * static_cast<float>(y[i]) * static_cast<float>(high - low));
  }
}

// Mean of the taps; `most` is the largest count of them.
void mean_of_taps(const TextureLanes& textures, const Taps& taps, int most, Lanes& mean) {
  LevelBlend blend;
  blend_levels(textures, taps, blend);
  float any_share = 0.0F;
  for (std::size_t i = 0; i < kLanes; ++i) any_share = std::max(any_share, blend.share[i]);
  mean.fill(0.0F);
  for (int tap = 0; tap < most; ++tap) {
    BitLanes u;
    BitLanes v;
    Lanes fine_weight;
    Lanes coarse_weight;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const auto along = static_cast<float>(std::min(tap, taps.count[i] - 1));
      u[i] = tile_point((taps.first_u[i] + along * taps.step_u[i]) * textures.per_m[i]);
      v[i] = tile_point((taps.first_v[i] + along * taps.step_v[i]) * textures.per_m[i]);
      const float weight = tap < taps.count[i] ? 1.0F : 0.0F;
      coarse_weight[i] = weight * blend.share[i];
      fine_weight[i] = weight - coarse_weight[i];
    }
    add_level(textures, blend.fine, u, v, fine_weight, mean);
    if (any_share > 0.0F) add_level(textures, blend.coarse, u, v, coarse_weight, mean);
  }
  constexpr float kUnit = 1.0F / (1U << kWeightBits);
  for (std::size_t i = 0; i < kLanes; ++i)
    mean[i] *= kUnit * textures.scale[i] / static_cast<float>(taps.count[i]);
}

}  // namespace

Taps taps_of(const SurfacePoints& points) {
  Taps taps;
  run_wide([&] {
    for (std::size_t i = 0; i < kLanes; ++i) {
      constexpr float kMostTaps = 4.0F;
      const float ratio = points.major_m[i] / std::max(points.minor_m[i], 1e-9F);
      const auto count =
          static_cast<std::int32_t>(std::min(std::max(ratio + 0.5F, 1.0F), kMostTaps));
      const auto n = static_cast<float>(count);
      taps.count[i] = count;
      taps.width_m[i] = std::max(points.minor_m[i], points.major_m[i] / n);
      taps.step_u[i] = points.major_u[i] / n;
      taps.step_v[i] = points.major_v[i] / n;
      taps.first_u[i] = points.u[i] - 0.5F * (n - 1.0F) * taps.step_u[i];
      taps.first_v[i] = points.v[i] - 0.5F * (n - 1.0F) * taps.step_v[i];
    }
  });
  return taps;
}

Lanes gray_albedo(const SurfacePoints& points, const Taps& taps) {
  const int most = *std::max_element(taps.count.begin(), taps.count.end());
  const TextureLanes bases = base_textures(points);
  const TextureLanes details = detail_textures(points);
  Lanes tint;
  for (std::size_t i = 0; i < kLanes; ++i) tint[i] = points.material[i]->tint_luminance;
  Lanes albedo;
  run_wide([&] {
    mean_of_taps(bases, taps, most, albedo);
    for (std::size_t i = 0; i < kLanes; ++i) albedo[i] *= tint[i];
    // Where a sample covers a whole tile of the detail, nothing of it is left.
    float narrowest = 1.0F;
    for (std::size_t i = 0; i < kLanes; ++i)
      narrowest = std::min(narrowest, taps.width_m[i] * details.per_m[i]);
    if (!(narrowest < 1.0F)) return;
    Lanes detail;
    mean_of_taps(details, taps, most, detail);
    for (std::size_t i = 0; i < kLanes; ++i)
      detail[i] = taps.width_m[i] * details.per_m[i] < 1.0F ? 2.0F * detail[i] : 1.0F;
    for (std::size_t i = 0; i < kLanes; ++i) albedo[i] *= detail[i];
  });
  return albedo;
}

}  // namespace km
