#include "apps/lab/simulation/world/canvas.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace km {
namespace {

/// Weights of four neighbours of a uniform cubic B-spline at t in [0, 1).
std::array<float, 4> spline_weights(float t) {
  const float s = 1.0F - t;
  const float t2 = t * t;
  return {s * s * s / 6.0F, (3.0F * t2 * t - 6.0F * t2 + 4.0F) / 6.0F,
          (3.0F * s * s * s - 6.0F * s * s + 4.0F) / 6.0F, t2 * t / 6.0F};
}

/// One period of random values, interpolated to `size` samples.
void interpolate_row(const float* lattice, int cells, int size, float* row) {
  const int stride = size / cells;
  const auto mask = static_cast<unsigned>(cells - 1);
  for (int offset = 0; offset < stride; ++offset) {
    const std::array<float, 4> w =
        spline_weights(static_cast<float>(offset) / static_cast<float>(stride));
    for (int c = 0; c < cells; ++c) {
      const auto cell = static_cast<unsigned>(c);
      row[c * stride + offset] = w[0] * lattice[(cell - 1U) & mask] + w[1] * lattice[cell] +
                                 w[2] * lattice[(cell + 1U) & mask] +
                                 w[3] * lattice[(cell + 2U) & mask];
    }
  }
}

/// Adds one octave of the given standard deviation.
void add_octave(int cells_u, int cells_v, float deviation, SeededRandom& random,
                NoiseField& field) {
  const int size = field.size();
  const auto width = static_cast<std::size_t>(size);
  std::vector<float> rows(static_cast<std::size_t>(cells_v) * width);
  std::vector<float> lattice(static_cast<std::size_t>(cells_u));
  for (std::size_t r = 0; r < static_cast<std::size_t>(cells_v); ++r) {
    for (float& value : lattice) value = random.uniform(-1.0F, 1.0F);
    interpolate_row(lattice.data(), cells_u, size, rows.data() + r * width);
  }
  // Uniform values have variance 1/3; the spline keeps the mean square of its weights along each
  // axis: 0.479 on average, 0.5 where a cell is one sample.
  const auto kept = [size](int cells) { return cells == size ? 0.5F : 0.479F; };
  const float scale = deviation / std::sqrt(kept(cells_u) * kept(cells_v) / 3.0F);
  const int stride = size / cells_v;
  const int mask = cells_v - 1;
  for (int y = 0; y < size; ++y) {
    const int cell = y / stride;
    const std::array<float, 4> w =
        spline_weights(static_cast<float>(y % stride) / static_cast<float>(stride));
    const auto row = [&](int r) {
      return rows.data() + static_cast<std::size_t>(r & mask) * width;
    };
    const float* const a = row(cell - 1);
    const float* const b = row(cell);
    const float* const c = row(cell + 1);
    const float* const d = row(cell + 2);
    float* const out = field.values().data() + static_cast<std::size_t>(y) * width;
    for (std::size_t x = 0; x < width; ++x)
      out[x] += scale * (w[0] * a[x] + w[1] * b[x] + w[2] * c[x] + w[3] * d[x]);
  }
}

}  // namespace

void NoiseField::standardize() {
  double sum = 0.0;
  double squares = 0.0;
  for (const float value : values_) {
    sum += value;
    squares += static_cast<double>(value) * value;
  }
  const auto count = static_cast<double>(values_.size());
  const double mean = sum / count;
  const double deviation = std::sqrt(std::max(squares / count - mean * mean, 0.0));
  const double scale = deviation > 0.0 ? 1.0 / deviation : 0.0;
  for (float& value : values_) value = static_cast<float>((value - mean) * scale);
}

NoiseField fractal_noise(int size, const FractalNoise& noise, SeededRandom& random) {
  NoiseField field(size);
  const int finest = noise.finest > 0 ? std::min(noise.finest, size) : size;
  int u = noise.cells_u;
  int v = noise.cells_v;
  float deviation = 1.0F;
  while (std::max(u, v) <= finest) {
    add_octave(u, v, deviation, random, field);
    u *= 2;
    v *= 2;
    deviation *= noise.gain;
  }
  field.standardize();
  return field;
}

NoiseField relief(const NoiseField& height) {
  NoiseField slope(height.size());
  for (int y = 0; y < height.size(); ++y)
    for (int x = 0; x < height.size(); ++x) slope(x, y) = height(x, y) - height(x - 1, y - 1);
  slope.standardize();
  return slope;
}

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

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
      if (inside((c * dx + s * dy) / half_size.x(), (c * dy - s * dx) / half_size.y()))
        texel(x, y) = color;
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
