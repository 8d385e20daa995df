#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {

/// A square tile to paint on that repeats without a seam: a shape that leaves it on one side enters
/// on the other. Lengths and positions are in tiles, u to the right and v up.
class Canvas {
 public:
  explicit Canvas(int size, const Eigen::Vector3f& color = Eigen::Vector3f::Ones())
      : size_(size), rgb_(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), color) {}

  /// A canvas whose texel (x, y) is shade(x, y).
  template <typename Shade>
  static Canvas painted(int size, const Shade& shade) {
    Canvas canvas(size);
    std::size_t i = 0;
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x) canvas.rgb_[i++] = shade(x, y);
    return canvas;
  }

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] Eigen::Vector3f& texel(int x, int y) {
    const int mask = size_ - 1;
    return rgb_[static_cast<std::size_t>(y & mask) * static_cast<std::size_t>(size_) +
                static_cast<std::size_t>(x & mask)];
  }

  /// Texels whose centre lies within half_size of `center` after turning by `angle` [rad].
  void rectangle(const Eigen::Vector2f& center, const Eigen::Vector2f& half_size, float angle,
                 const Eigen::Vector3f& color);
  /// Texels within an ellipse with these half axes.
  void ellipse(const Eigen::Vector2f& center, const Eigen::Vector2f& half_size, float angle,
               const Eigen::Vector3f& color);
  /// A line with round ends.
  void line(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float width,
            const Eigen::Vector3f& color);
  /// Rows of words in an invented alphabet, from the top left corner down.
  void text(const Eigen::Vector2f& top_left, const Eigen::Vector2f& extent, float row_height,
            const Eigen::Vector3f& color, SeededRandom& random);

  /// The painted texels, clamped to [0, 1]. The canvas is empty afterwards.
  [[nodiscard]] std::vector<Eigen::Vector3f> take();

 private:
  template <typename Inside>
  void shape(const Eigen::Vector2f& center, const Eigen::Vector2f& half_size, float angle,
             const Eigen::Vector3f& color, const Inside& inside);

  int size_;
  std::vector<Eigen::Vector3f> rgb_;
};

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
  int cells_v = 4;    ///< Grid cells along v; fewer than along u gives streaks along v.
  float gain = 0.8F;  ///< Ratio of the standard deviations of an octave and the one before; images
                      ///< of nature have about 1.
  int finest = 0;     ///< No octave has more cells than this; 0: up to one cell a texel.
};

/// Mean 0, standard deviation 1.
[[nodiscard]] NoiseField fractal_noise(int size, const FractalNoise& noise, SeededRandom& random);

/// Shading of a surface of this height lit along +u +v: the slope, mean 0, standard deviation 1.
[[nodiscard]] NoiseField relief(const NoiseField& height);

/// 0 below `low`, 1 above `high`, smooth between.
[[nodiscard]] float smooth_step(float low, float high, float x);

}  // namespace km
