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

  /// Trilinear lookup. `uv` in tiles: it repeats, up to 2^31 / size tiles from zero, beyond which
  /// the result is undefined; `footprint` is the width of what one sample covers, in tiles. Between
  /// two levels the blend is linear in the footprint.
  [[nodiscard]] Eigen::Vector3f color(const Eigen::Vector2f& uv, float footprint) const;
  /// The same of the luminance alone (Rec. 709 weights): what a grey camera sees.
  [[nodiscard]] float luminance(const Eigen::Vector2f& uv, float footprint) const;

 private:
  static constexpr int kMaxLogSize = 12;

  /// Two levels and how far the footprint lies between them, 0 to 1.
  struct LevelBlend {
    int fine = 0;
    int coarse = 0;
    float share = 0.0F;
  };
  /// Where a point falls in a level: its texel, the one to the right and above, and the weights.
  struct Cell {
    std::uint32_t row0 = 0, row1 = 0, column0 = 0, column1 = 0;
    float x = 0.0F, y = 0.0F;
  };

  [[nodiscard]] LevelBlend blend_of(float footprint) const;
  [[nodiscard]] Cell cell_of(int level, const Eigen::Vector2f& uv) const;
  [[nodiscard]] float bilinear_luminance(int level, const Eigen::Vector2f& uv) const;
  [[nodiscard]] Eigen::Vector3f bilinear_color(int level, const Eigen::Vector2f& uv) const;
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

inline Texture::Cell Texture::cell_of(int level, const Eigen::Vector2f& uv) const {
  const int log_n = log_size_ - level;
  const auto n = static_cast<float>(1 << log_n);
  const float x = uv.x() * n - 0.5F;
  const float y = uv.y() * n - 0.5F;
  int column = static_cast<int>(x);  // rounds towards zero
  int row = static_cast<int>(y);
  column -= static_cast<int>(x < static_cast<float>(column));  // floor
  row -= static_cast<int>(y < static_cast<float>(row));
  const std::uint32_t mask = (1U << log_n) - 1U;
  const auto first_row = static_cast<std::uint32_t>(row);
  const auto first_column = static_cast<std::uint32_t>(column);
  const std::uint32_t begin = level_begin_[static_cast<std::size_t>(level)];
  return {begin + ((first_row & mask) << log_n),
          begin + (((first_row + 1U) & mask) << log_n),
          first_column & mask,
          (first_column + 1U) & mask,
          x - static_cast<float>(column),
          y - static_cast<float>(row)};
}

inline float Texture::bilinear_luminance(int level, const Eigen::Vector2f& uv) const {
  const Cell cell = cell_of(level, uv);
  const std::uint32_t quad = luminance_[cell.row0 + cell.column0];
  const auto byte = [quad](int i) { return static_cast<float>((quad >> (8 * i)) & 0xFFU); };
  const float low = byte(0) + cell.x * (byte(1) - byte(0));
  const float high = byte(2) + cell.x * (byte(3) - byte(2));
  return low + cell.y * (high - low);
}

inline float Texture::luminance(const Eigen::Vector2f& uv, float footprint) const {
  const LevelBlend blend = blend_of(footprint);
  const float fine = bilinear_luminance(blend.fine, uv);
  if (blend.share == 0.0F) return luminance_scale_ * fine;
  const float coarse = bilinear_luminance(blend.coarse, uv);
  return luminance_scale_ * (fine + blend.share * (coarse - fine));
}

}  // namespace km
