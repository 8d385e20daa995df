#pragma once

#include <Eigen/Core>
#include <array>
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

  /// The luminance (Rec. 709 weights) for grey cameras, stored for lookups of many points side by
  /// side. All levels follow each other in rows of `quads`. A quad has a texel and its neighbours
  /// at +u, +v, +uv (lowest byte first) in steps of `scale`. Valid as long as the texture exists.
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
  /// Position of a point in a level: its texel, and the distance to the next one to the right and
  /// above, in units of 2^-16.
  struct Cell {
    std::uint32_t column = 0, row = 0;
    std::int32_t x = 0, y = 0;
  };

  [[nodiscard]] static TilePoint tile_point(const Eigen::Vector2f& uv);
  [[nodiscard]] LevelBlend blend_of(float footprint) const;
  [[nodiscard]] static Cell cell_of(int log_n, const TilePoint& point);
  [[nodiscard]] Eigen::Vector3f bilinear_color(int level, const TilePoint& point) const;
  void append_level(int n, const std::vector<Eigen::Vector3f>& rgb);

  int log_size_ = 0;
  float luminance_scale_ = 1.0F;  // luminance of one step of 8 bit: dark textures keep 255 shades
  float color_scale_ = 1.0F;
  std::array<std::uint32_t, kMaxLogSize + 1> level_begin_{};
  // All levels in one array. A luminance entry has its texel and the neighbours at +u, +v, +uv
  // (lowest byte first), so that a bilinear lookup is one load. A colour is red, green, blue, 0.
  std::vector<std::uint32_t> luminance_;
  std::vector<std::uint32_t> color_;
};

}  // namespace km
