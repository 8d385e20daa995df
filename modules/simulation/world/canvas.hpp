#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

#include "modules/simulation/world/seeded_random.hpp"

namespace km {

/// A square tile to paint on that repeats without a seam: what leaves it on one side comes in on
/// the other. Lengths and positions are in tiles, u to the right and v up.
class Canvas {
 public:
  explicit Canvas(int size, const Eigen::Vector3f& color = Eigen::Vector3f::Ones())
      : size_(size), rgb_(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), color) {}

  /// A canvas whose texel (x, y) is shade(x, y).
  template <typename Shade>
  static Canvas painted(int size, const Shade& shade) {
    Canvas canvas(size);
    std::size_t i = 0;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) canvas.rgb_[i++] = shade(x, y);
    }
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
  /// The same of an ellipse with these half axes.
  void ellipse(const Eigen::Vector2f& center, const Eigen::Vector2f& half_size, float angle,
               const Eigen::Vector3f& color);
  /// A line with round ends.
  void line(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float width,
            const Eigen::Vector3f& color);
  /// Rows of words in letters that no language has, from the top left corner down.
  void text(const Eigen::Vector2f& top_left, const Eigen::Vector2f& extent, float row_height,
            const Eigen::Vector3f& color, SeededRandom& random);

  /// What was painted, clamped to [0, 1]. The canvas is empty afterwards.
  [[nodiscard]] std::vector<Eigen::Vector3f> take();

 private:
  template <typename Inside>
  void shape(const Eigen::Vector2f& center, const Eigen::Vector2f& half_size, float angle,
             const Eigen::Vector3f& color, const Inside& inside);

  int size_;
  std::vector<Eigen::Vector3f> rgb_;
};

}  // namespace km
