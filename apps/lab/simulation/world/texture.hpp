#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace km {

/// A square RGB tile that repeats without a seam, with its mipmaps: level 0 has `size` texels on an
/// edge, each level half of the one before, down to 1. Texel i of a level of n texels is centred at
/// (i + 0.5) / n. Immutable, safe to use from several threads.
class Texture {
 public:
  /// `size` is a power of two, at most 4096; `rgb` holds size * size linear albedos in [0, 1], row
  /// by row (u runs along a row).
  Texture(int size, const std::vector<Eigen::Vector3f>& rgb);

  /// Mean albedo of the tile.
  [[nodiscard]] const Eigen::Vector3f& mean_color() const { return mean_color_; }

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
  void append_level(int n, const std::vector<Eigen::Vector3f>& rgb);

  int log_size_ = 0;
  float luminance_scale_ = 1.0F;  // luminance of one step of 8 bit: dark textures keep 255 shades
  Eigen::Vector3f mean_color_ = Eigen::Vector3f::Zero();
  // All levels in one array. An entry has its texel and the neighbours at +u, +v, +uv (lowest byte
  // first), so that a bilinear lookup is one load.
  std::vector<std::uint32_t> luminance_;
};

}  // namespace km
