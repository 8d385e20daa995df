#include "apps/lab/simulation/world/printed_textures.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/lab/simulation/world/scene.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

Vector2f anywhere(SeededRandom& random) {
  const float u = random.uniform(0.0F, 1.0F);
  return {u, random.uniform(0.0F, 1.0F)};
}

Vector3f ink(SeededRandom& random) {
  const float red = random.uniform(0.02F, 0.8F);
  const float green = random.uniform(0.02F, 0.7F);
  return {red, green, random.uniform(0.02F, 0.7F)};
}

/// Noise printed in one colour on another: from afar like a photograph.
void photograph(Canvas& canvas, const Vector2f& low, const Vector2f& extent,
                const NoiseField& noise, const Vector3f& dark, const Vector3f& bright) {
  const auto n = static_cast<float>(canvas.size());
  const auto texel = [n](float length) { return static_cast<int>(std::lround(length * n)); };
  for (int y = texel(low.y()); y < texel(low.y() + extent.y()); ++y) {
    for (int x = texel(low.x()); x < texel(low.x() + extent.x()); ++x) {
      const float share = smooth_step(-1.6F, 1.6F, noise(x, y));
      canvas.texel(x, y) = dark + share * (bright - dark);
    }
  }
}

/// One print of a sheet of 4 x 4, its lower left corner at `low`, an edge of `edge` tiles.
void poster(Canvas& canvas, const Vector2f& low, float edge, const NoiseField& noise,
            SeededRandom& random) {
  const Vector2f middle = low + Vector2f::Constant(0.5F * edge);
  const auto at = [&](float u, float v) -> Vector2f { return low + edge * Vector2f(u, v); };
  const bool light = random.chance(0.65);
  const Vector3f paper = light ? Vector3f(0.82F, 0.8F, 0.76F) : 0.5F * ink(random);
  const Vector3f print = light ? 0.4F * ink(random) : Vector3f(0.85F, 0.84F, 0.8F);
  canvas.rectangle(middle, Vector2f::Constant(0.5F * edge), 0.0F, paper);
  const float top = random.uniform(0.74F, 0.84F);
  canvas.text(at(0.08F, 0.95F), edge * Vector2f(0.84F, 0.95F - top),
              edge * random.uniform(0.1F, 0.19F), print, random);
  const float picture = random.uniform(0.3F, 0.6F);
  switch (random.below(3)) {
    case 0:
      photograph(canvas, at(0.08F, top - picture), edge * Vector2f(0.84F, picture - 0.03F), noise,
                 0.3F * ink(random), Vector3f(0.85F, 0.83F, 0.8F));
      break;
    case 1:
      for (int i = 0; i < 14; ++i) {
        const Vector2f center =
            at(random.uniform(0.15F, 0.85F), random.uniform(top - picture + 0.05F, top - 0.08F));
        const Vector2f half =
            edge * Vector2f(random.uniform(0.02F, 0.12F), random.uniform(0.02F, 0.05F));
        const Vector3f color = ink(random);
        if (random.chance(0.5))
          canvas.ellipse(center, half, random.uniform(0.0F, kPi), color);
        else
          canvas.rectangle(center, half, random.uniform(0.0F, kPi), color);
      }
      break;
    default:
      for (int i = 0; i < 9; ++i) {  // a bar chart
        const float height = random.uniform(0.1F, 1.0F) * (picture - 0.06F);
        const float u = 0.13F + 0.09F * static_cast<float>(i);
        canvas.rectangle(at(u, top - picture + 0.5F * height),
                         edge * Vector2f(0.032F, 0.5F * height), 0.0F, ink(random));
      }
  }
  const float below = top - picture - 0.04F;
  canvas.text(at(0.08F, below), edge * Vector2f(0.4F, below - 0.05F), 0.035F * edge, print, random);
  canvas.text(at(0.54F, below), edge * Vector2f(0.38F, below - 0.05F), 0.035F * edge, print,
              random);
}

}  // namespace

Canvas play_mat(int size, SeededRandom& random) {
  const NoiseField pile = fractal_noise(size, {.cells_u = 16, .cells_v = 16, .gain = 1.0F}, random);
  Canvas canvas(size, {0.5F, 0.55F, 0.3F});
  for (int i = 0; i < 10; ++i) {  // fields and ponds
    const Vector2f half(random.uniform(0.05F, 0.13F), random.uniform(0.04F, 0.1F));
    const Vector3f color =
        random.chance(0.3) ? Vector3f(0.25F, 0.4F, 0.6F) : Vector3f(0.75F, 0.7F, 0.45F);
    canvas.ellipse(anywhere(random), half, random.uniform(0.0F, kPi), color);
  }
  for (int i = 0; i < 55; ++i) {  // houses with roofs of two halves, windows and a door
    const Vector2f at = anywhere(random);
    const Vector2f half(random.uniform(0.018F, 0.035F), random.uniform(0.015F, 0.028F));
    const float angle = random.chance(0.5) ? 0.0F : random.uniform(-0.5F, 0.5F);
    canvas.rectangle(at, 1.2F * half, angle, Vector3f::Constant(0.8F));
    canvas.rectangle(at, half, angle, ink(random));
    const Vector2f ridge(half.x() * std::cos(angle), half.x() * std::sin(angle));
    canvas.line(at - ridge, at + ridge, 0.006F, Vector3f::Constant(0.06F));
  }
  for (int i = 0; i < 150; ++i) {  // trees
    const Vector2f at = anywhere(random);
    const float radius = random.uniform(0.006F, 0.014F);
    canvas.ellipse(at, {radius, radius}, 0.0F, {0.05F, 0.16F, 0.05F});
    canvas.ellipse(at + Vector2f(0.2F * radius, 0.2F * radius), {0.5F * radius, 0.5F * radius},
                   0.0F, {0.2F, 0.45F, 0.15F});
  }
  const auto street = [&](auto curve) {  // kerb, tarmac, dashes: each over the whole way at once
    constexpr int kSteps = 96;
    const std::array<std::pair<float, Vector3f>, 2> layers = {
        {{0.062F, Vector3f::Constant(0.85F)}, {0.05F, Vector3f::Constant(0.3F)}}};
    for (const auto& [width, color] : layers)
      for (int i = 0; i < kSteps; ++i)
        canvas.line(curve(static_cast<float>(i) / kSteps),
                    curve(static_cast<float>(i + 1) / kSteps), width, color);
    for (int i = 0; i < kSteps; i += 3)
      canvas.line(curve(static_cast<float>(i) / kSteps),
                  curve((static_cast<float>(i) + 1.2F) / kSteps), 0.005F,
                  Vector3f::Constant(0.85F));
  };
  for (const float v : {0.2F, 0.7F}) {
    const float swing = random.uniform(0.04F, 0.12F);
    street([&](float t) { return Vector2f(t, v + swing * std::sin(2.0F * kPi * t)); });
  }
  const float bow = random.uniform(0.05F, 0.1F);
  street([&](float t) { return Vector2f(0.45F + bow * std::sin(4.0F * kPi * t), t); });
  street([&](float t) {
    return Vector2f(0.75F + 0.13F * std::cos(2.0F * kPi * t),
                    0.45F + 0.11F * std::sin(2.0F * kPi * t));
  });
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) canvas.texel(x, y) *= 1.0F + 0.05F * pile(x, y);
  return canvas;
}

Canvas marker_tape(int size, SeededRandom& random) {
  constexpr int kStrips = 16;
  Canvas canvas(size, Vector3f::Constant(0.06F));
  for (int strip = 0; strip < kStrips; ++strip) {
    for (float u = 0.0F; u < 0.99F; u += random.uniform(0.009F, 0.022F)) {
      const float v = (static_cast<float>(strip) + random.uniform(0.2F, 0.8F)) / kStrips;
      const Vector2f half(random.uniform(0.003F, 0.0055F), random.uniform(0.004F, 0.009F));
      canvas.rectangle({u, v}, half, random.uniform(0.0F, kPi), Vector3f::Constant(0.78F));
    }
  }
  return canvas;
}

Canvas tag_grid(int size, SeededRandom& random) {
  constexpr int kTags = 6;
  constexpr int kBits = 6;
  const Vector3f white = Vector3f::Constant(0.8F);
  const Vector3f black = Vector3f::Constant(0.055F);
  Canvas canvas(size, white);
  const float pitch = 1.0F / (kTags + 0.6F);
  const float edge = pitch / 1.3F;
  const float bit = edge / (kBits + 2);
  for (int row = 0; row <= kTags; ++row) {
    for (int column = 0; column <= kTags; ++column) {
      const Vector2f low(0.45F * pitch + pitch * static_cast<float>(column),
                         0.45F * pitch + pitch * static_cast<float>(row));
      const float gap = pitch - edge;  // a small square fills every crossing of the gaps
      canvas.rectangle(low - Vector2f::Constant(0.5F * gap), Vector2f::Constant(0.5F * gap), 0.0F,
                       black);
      if (row == kTags || column == kTags) continue;
      canvas.rectangle(low + Vector2f::Constant(0.5F * edge), Vector2f::Constant(0.5F * edge), 0.0F,
                       black);
      for (int i = 0; i < kBits * kBits; ++i) {
        if (random.chance(0.5)) continue;
        const Vector2f cell(static_cast<float>(i % kBits) + 1.5F,
                            static_cast<float>(i / kBits) + 1.5F);
        canvas.rectangle(low + bit * cell, Vector2f::Constant(0.5F * bit), 0.0F, white);
      }
    }
  }
  return canvas;
}

Canvas checker(int size, SeededRandom& /*random*/) {
  const int square = size / 8;
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    return Vector3f::Constant((x / square + y / square) % 2 == 0 ? 0.03F : 0.82F);
  });
}

Canvas posters(int size, SeededRandom& random) {
  const NoiseField noise =
      fractal_noise(size, {.cells_u = 16, .cells_v = 16, .gain = 0.9F}, random);
  Canvas canvas(size);
  for (int i = 0; i < 16; ++i) {
    const Vector2f low(0.25F * static_cast<float>(i % 4), 0.25F * static_cast<float>(i / 4));
    poster(canvas, low, 0.25F, noise, random);
  }
  return canvas;
}

Canvas newsprint(int size, SeededRandom& random) {
  const NoiseField noise = fractal_noise(size, {.cells_u = 8, .cells_v = 8, .gain = 0.9F}, random);
  const Vector3f black = Vector3f::Constant(0.06F);
  Canvas canvas(size, {0.74F, 0.72F, 0.67F});
  for (int column = 0; column < 4; ++column) {
    const float left = 0.02F + 0.25F * static_cast<float>(column);
    float top = 0.99F;
    while (top > 0.1F) {
      canvas.text({left, top}, {0.21F, 0.03F}, 0.028F, black, random);
      top -= 0.04F;
      if (random.chance(0.5)) {
        photograph(canvas, {left, top - 0.09F}, {0.21F, 0.085F}, noise, black,
                   {0.7F, 0.69F, 0.66F});
        top -= 0.1F;
      }
      const float block = std::min(random.uniform(0.08F, 0.2F), top - 0.02F);
      canvas.text({left, top}, {0.21F, block}, 0.0135F, black, random);
      top -= block + 0.02F;
    }
  }
  return canvas;
}

}  // namespace km
