#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/simulation/world/seeded_random.hpp"

namespace km {

/// A scalar function on a square that repeats without a seam: size x size samples, row by row.
class NoiseField {
 public:
  explicit NoiseField(int size, float value = 0.0F)
      : size_(size),
        values_(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), value) {}

  [[nodiscard]] int size() const { return size_; }

  /// Sample at any x and y: the field repeats. `size` is a power of two.
  [[nodiscard]] float operator()(int x, int y) const { return values_[index(x, y)]; }
  [[nodiscard]] float& operator()(int x, int y) { return values_[index(x, y)]; }

  [[nodiscard]] const std::vector<float>& values() const { return values_; }
  [[nodiscard]] std::vector<float>& values() { return values_; }

  /// Shifts and scales to mean 0 and standard deviation 1. A constant field becomes 0.
  void standardize();

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    const int mask = size_ - 1;
    return static_cast<std::size_t>(y & mask) * static_cast<std::size_t>(size_) +
           static_cast<std::size_t>(x & mask);
  }

  int size_;
  std::vector<float> values_;
};

/// Sum of octaves of random values on ever finer grids, each smoothly interpolated.
struct FractalNoise {
  int cells_u = 4;    ///< Grid cells along u in the first octave: a power of two.
  int cells_v = 4;    ///< The same along v; fewer than along u gives streaks along v.
  float gain = 0.8F;  ///< Standard deviation of an octave by that of the one before; images of
                      ///< nature have about 1.
  int finest = 0;     ///< No octave has more cells than this; 0: up to one cell a texel.
};

/// Mean 0, standard deviation 1.
[[nodiscard]] NoiseField fractal_noise(int size, const FractalNoise& noise, SeededRandom& random);

/// Distances to scattered points, one in each of cells x cells squares; `cells` divides the size.
struct CellNoise {
  NoiseField nearest;             ///< Distance to the nearest point, in cells.
  NoiseField edge;                ///< Distance to the second nearest less that to the nearest.
  std::vector<std::uint32_t> id;  ///< Which point is nearest, 0 to cells^2 - 1.
};
[[nodiscard]] CellNoise cell_noise(int size, int cells, SeededRandom& random);

/// How a surface of this height looks lit along +u +v: the slope, mean 0, standard deviation 1.
[[nodiscard]] NoiseField relief(const NoiseField& height);

/// 0 below `low`, 1 above `high`, smooth between.
[[nodiscard]] float smooth_step(float low, float high, float x);

}  // namespace km
