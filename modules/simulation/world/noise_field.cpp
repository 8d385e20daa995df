#include "modules/simulation/world/noise_field.hpp"

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
    for (std::size_t x = 0; x < width; ++x) {
      out[x] += scale * (w[0] * a[x] + w[1] * b[x] + w[2] * c[x] + w[3] * d[x]);
    }
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

CellNoise cell_noise(int size, int cells, SeededRandom& random) {
  struct Point {
    float x, y;
  };
  std::vector<Point> points(static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells));
  for (Point& point : points) {
    point.x = random.uniform(0.0F, 1.0F);
    point.y = random.uniform(0.0F, 1.0F);
  }
  CellNoise noise{NoiseField(size), NoiseField(size), {}};
  noise.id.resize(noise.nearest.values().size());
  const float texel = static_cast<float>(cells) / static_cast<float>(size);
  std::size_t i = 0;
  for (int row = 0; row < size; ++row) {
    const float y = (static_cast<float>(row) + 0.5F) * texel;
    for (int column = 0; column < size; ++column, ++i) {
      const float x = (static_cast<float>(column) + 0.5F) * texel;
      const int cx = static_cast<int>(x);
      const int cy = static_cast<int>(y);
      float first = 1e9F;  // squared distances
      float second = 1e9F;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int px = cx + dx;
          const int py = cy + dy;
          const int wrapped_x = px < 0 ? cells - 1 : (px == cells ? 0 : px);
          const int wrapped_y = py < 0 ? cells - 1 : (py == cells ? 0 : py);
          const auto id = static_cast<std::uint32_t>(wrapped_y * cells + wrapped_x);
          const float to_x = static_cast<float>(px) + points[id].x - x;
          const float to_y = static_cast<float>(py) + points[id].y - y;
          const float distance = to_x * to_x + to_y * to_y;
          if (distance < first) noise.id[i] = id;
          second = std::min(second, std::max(first, distance));
          first = std::min(first, distance);
        }
      }
      noise.nearest.values()[i] = std::sqrt(first);
      noise.edge.values()[i] = std::sqrt(second) - std::sqrt(first);
    }
  }
  return noise;
}

NoiseField relief(const NoiseField& height) {
  NoiseField slope(height.size());
  for (int y = 0; y < height.size(); ++y) {
    for (int x = 0; x < height.size(); ++x) {
      slope(x, y) = height(x, y) - height(x - 1, y - 1);
    }
  }
  slope.standardize();
  return slope;
}

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

}  // namespace km
