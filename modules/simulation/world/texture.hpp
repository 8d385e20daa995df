#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace km {

/// A square RGB tile that repeats without a seam, with its mipmaps: level 0 has `size` texels on an
/// edge, each level half of the one before, down to 1. Texel i of a level of n texels is centred at
/// (i + 0.5) / n. Immutable, safe to use from several threads.
class Texture {
 public:
  /// `size` is a power of two, at most 4096; `rgb` holds size * size linear albedos in [0, 1], row
  /// by row (u runs along a row). Throws std::invalid_argument otherwise.
  Texture(int size, const std::vector<Eigen::Vector3f>& rgb);

  [[nodiscard]] int size() const { return 1 << log_size_; }
  [[nodiscard]] int levels() const { return log_size_ + 1; }

  /// Trilinear lookup. `uv` in tiles: it repeats, up to 2^31 tiles from zero, beyond which the
  /// result is undefined; `footprint` is the width of what one sample covers, in tiles. Between two
  /// levels the blend is linear in the footprint.
  [[nodiscard]] Eigen::Vector3f color(const Eigen::Vector2f& uv, float footprint) const;
  /// The same of the luminance alone (Rec. 709 weights): what a grey camera sees.
  [[nodiscard]] float luminance(const Eigen::Vector2f& uv, float footprint) const;

  /// The storage behind luminance(), for lookups of many points side by side: all levels one after
  /// the other, rows of `quads`, each a texel and its neighbours at +u, +v, +uv (lowest byte first)
  /// in steps of `scale`. Valid as long as the texture is.
  struct GrayTexels {
    const std::uint32_t* quads = nullptr;
    int log_size = 0;
    float scale = 1.0F;
  };
  [[nodiscard]] GrayTexels gray_texels() const {
    return {luminance_.data(), log_size_, luminance_scale_};
  }

 private:
  static constexpr int kMaxLogSize = 12;

  /// Two levels and how far the footprint lies between them, 0 to 1.
  struct LevelBlend {
    int fine = 0;
    int coarse = 0;
    float share = 0.0F;
  };
  /// A point of the tile, each coordinate in units of 2^-32: it wraps by itself.
  struct TilePoint {
    std::uint32_t u = 0, v = 0;
  };
  /// Where a point falls in a level: its texel, and how far it is to the next one to the right and
  /// above, in units of 2^-16.
  struct Cell {
    std::uint32_t column = 0, row = 0;
    std::int32_t x = 0, y = 0;
  };

  [[nodiscard]] static TilePoint tile_point(const Eigen::Vector2f& uv);
  [[nodiscard]] LevelBlend blend_of(float footprint) const;
  [[nodiscard]] static Cell cell_of(int log_n, const TilePoint& point);
  [[nodiscard]] float bilinear_luminance(int level, const TilePoint& point) const;
  [[nodiscard]] Eigen::Vector3f bilinear_color(int level, const TilePoint& point) const;
  void append_level(int n, const std::vector<Eigen::Vector3f>& rgb);

  int log_size_ = 0;
  float luminance_scale_ = 1.0F;  // of one step of 8 bit: dark textures keep 255 shades
  float color_scale_ = 1.0F;
  std::array<std::uint32_t, kMaxLogSize + 1> level_begin_{};
  // All levels in one piece. A luminance entry holds its texel and the neighbours at +u, +v, +uv
  // (lowest byte first): a bilinear lookup is one load. A colour is red, green, blue, 0.
  std::vector<std::uint32_t> luminance_;
  std::vector<std::uint32_t> color_;
};

// The lookups are in the header because the renderer makes millions of them per image.

inline Texture::LevelBlend Texture::blend_of(float footprint) const {
  const float texels = footprint * static_cast<float>(1 << log_size_);
  if (!(texels > 1.0F)) return {};
  const auto bits = std::bit_cast<std::uint32_t>(texels);
  const int level = static_cast<int>(bits >> 23) - 127;  // the exponent: floor(log2(texels))
  if (level >= log_size_) return {log_size_, log_size_, 0.0F};
  const float mantissa = std::bit_cast<float>((bits & 0x007FFFFFU) | 0x3F800000U);  // 1 to 2
  return {level, level + 1, mantissa - 1.0F};
}

inline Texture::TilePoint Texture::tile_point(const Eigen::Vector2f& uv) {
  constexpr float kTile = 4294967296.0F;  // 2^32
  const auto wrapped = [](float tiles) {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(tiles * kTile));
  };
  return {wrapped(uv.x()), wrapped(uv.y())};
}

inline Texture::Cell Texture::cell_of(int log_n, const TilePoint& point) {
  const std::uint32_t half_texel = 0x80000000U >> log_n;
  const std::uint64_t u = static_cast<std::uint64_t>(point.u - half_texel) << log_n;
  const std::uint64_t v = static_cast<std::uint64_t>(point.v - half_texel) << log_n;
  return {static_cast<std::uint32_t>(u >> 32), static_cast<std::uint32_t>(v >> 32),
          static_cast<std::int32_t>(u >> 16 & 0xFFFFU),
          static_cast<std::int32_t>(v >> 16 & 0xFFFFU)};
}

/// In units of 2^-16 of a step of the storage.
inline float Texture::bilinear_luminance(int level, const TilePoint& point) const {
  const int log_n = log_size_ - level;
  const Cell cell = cell_of(log_n, point);
  const std::uint32_t quad =
      luminance_[level_begin_[static_cast<std::size_t>(level)] + (cell.row << log_n) + cell.column];
  const auto byte = [quad](int i) { return static_cast<std::int32_t>(quad >> (8 * i) & 0xFFU); };
  const std::int32_t low = (byte(0) << 16) + cell.x * (byte(1) - byte(0));
  const std::int32_t high = (byte(2) << 16) + cell.x * (byte(3) - byte(2));
  constexpr float kUnit = 1.0F / 65536.0F;
  return static_cast<float>(low) +
         kUnit * static_cast<float>(cell.y) * static_cast<float>(high - low);
}

inline float Texture::luminance(const Eigen::Vector2f& uv, float footprint) const {
  constexpr float kUnit = 1.0F / 65536.0F;
  const TilePoint point = tile_point(uv);
  const LevelBlend blend = blend_of(footprint);
  const float fine = bilinear_luminance(blend.fine, point);
  const float coarse = bilinear_luminance(blend.coarse, point);
  return kUnit * luminance_scale_ * (fine + blend.share * (coarse - fine));
}

}  // namespace km
