#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace km {

/// A square RGB tile that repeats without a seam, with its mipmaps: level 0 has `size` texels on an
/// edge, each level half of the one before, down to 1.
class Texture {
 public:
  /// `size` is a power of two, at most 4096; `rgb` holds size * size linear albedos in [0, 1], row
  /// by row. Throws std::invalid_argument otherwise.
  Texture(int size, const std::vector<Eigen::Vector3f>& rgb);

  [[nodiscard]] int size() const { return size_; }

  /// Trilinear lookup. `uv` in tiles (any value: it repeats); `footprint` is the width of what one
  /// sample covers, in tiles.
  [[nodiscard]] Eigen::Vector3f color(const Eigen::Vector2f& uv, float footprint) const;
  /// The same of the luminance alone (Rec. 709 weights): what a grey camera sees.
  [[nodiscard]] float luminance(const Eigen::Vector2f& uv, float footprint) const;

 private:
  int size_ = 0;
  std::vector<std::vector<std::uint8_t>> luminance_;  // per level
  std::vector<std::vector<std::uint8_t>> rgb_;        // per level, interleaved
};

}  // namespace km
