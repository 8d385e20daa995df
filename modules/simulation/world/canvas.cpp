#include "modules/simulation/world/canvas.hpp"

#include <algorithm>
#include <cmath>

namespace km {

template <typename Inside>
void Canvas::shape(const Eigen::Vector2f& center, const Eigen::Vector2f& half_size, float angle,
                   const Eigen::Vector3f& color, const Inside& inside) {
  const auto n = static_cast<float>(size_);
  const float c = std::cos(angle);
  const float s = std::sin(angle);
  const float reach_x = std::abs(c) * half_size.x() + std::abs(s) * half_size.y();
  const float reach_y = std::abs(s) * half_size.x() + std::abs(c) * half_size.y();
  const auto first = [n](float low) { return static_cast<int>(std::floor(low * n)); };
  const auto last = [n](float high) { return static_cast<int>(std::ceil(high * n)); };
  for (int y = first(center.y() - reach_y); y <= last(center.y() + reach_y); ++y) {
    const float dy = (static_cast<float>(y) + 0.5F) / n - center.y();
    for (int x = first(center.x() - reach_x); x <= last(center.x() + reach_x); ++x) {
      const float dx = (static_cast<float>(x) + 0.5F) / n - center.x();
      if (inside((c * dx + s * dy) / half_size.x(), (c * dy - s * dx) / half_size.y())) {
        texel(x, y) = color;
      }
    }
  }
}

void Canvas::rectangle(const Eigen::Vector2f& center, const Eigen::Vector2f& half_size, float angle,
                       const Eigen::Vector3f& color) {
  shape(center, half_size, angle, color,
        [](float a, float b) { return std::abs(a) <= 1.0F && std::abs(b) <= 1.0F; });
}

void Canvas::ellipse(const Eigen::Vector2f& center, const Eigen::Vector2f& half_size, float angle,
                     const Eigen::Vector3f& color) {
  shape(center, half_size, angle, color, [](float a, float b) { return a * a + b * b <= 1.0F; });
}

void Canvas::line(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float width,
                  const Eigen::Vector3f& color) {
  const Eigen::Vector2f along = to - from;
  const float half_length = 0.5F * along.norm();
  const float half_width = 0.5F * width;
  const float straight = half_length / half_width;  // everything in half widths
  shape(0.5F * (from + to), {half_length + half_width, half_width},
        std::atan2(along.y(), along.x()), color, [straight](float a, float b) {
          const float beyond = std::max(std::abs(a) * (straight + 1.0F) - straight, 0.0F);
          return beyond * beyond + b * b <= 1.0F;
        });
}

void Canvas::text(const Eigen::Vector2f& top_left, const Eigen::Vector2f& extent, float row_height,
                  const Eigen::Vector3f& color, SeededRandom& random) {
  const float letter = 0.55F * row_height;
  const float stroke = 0.14F * row_height;
  for (float down = row_height; down <= extent.y(); down += row_height) {
    float at = 0.0F;
    int letters_left = 2 + random.below(7);
    while (at + letter <= extent.x()) {
      if (letters_left-- == 0) {
        letters_left = 2 + random.below(7);
        at += letter;
        continue;
      }
      const Eigen::Vector2f foot = top_left + Eigen::Vector2f(at, -down);
      for (int i = 0; i < 3; ++i) {  // three strokes on a grid of 2 x 3 points make a letter
        const auto corner = [&] {
          const auto column = static_cast<float>(random.below(2));
          const auto row = static_cast<float>(random.below(3));
          return Eigen::Vector2f(0.7F * letter * column, 0.33F * row_height * row);
        };
        const Eigen::Vector2f from = corner();
        const Eigen::Vector2f to = corner();
        line(foot + from, foot + to, stroke, color);
      }
      at += letter;
    }
  }
}

std::vector<Eigen::Vector3f> Canvas::take() {
  for (Eigen::Vector3f& color : rgb_) color = color.cwiseMax(0.0F).cwiseMin(1.0F);
  return std::exchange(rgb_, {});
}

}  // namespace km
