#include "apps/lab/simulation/rendering/sky.hpp"

#include <algorithm>
#include <cmath>

#include "apps/lab/simulation/rendering/surfaces.hpp"
#include "apps/lab/simulation/world/canvas.hpp"
#include "apps/lab/simulation/world/terrain.hpp"

namespace km {
namespace {

constexpr int kSize = 768;  // the horizon's circle touches the border: some 0.15 degrees a texel

float cloud_noise(float x, float y) {
  float sum = 0.0F;
  float amplitude = 0.5F;
  for (int octave = 0; octave < 5; ++octave) {
    sum += amplitude * (0.5F + 0.5F * ground_noise(x, y, 1.0F, 0));
    amplitude *= 0.5F;
    // Rotated a little, so that the lattices of the octaves do not coincide.
    const float turned = 1.7F * x - 1.1F * y + 17.3F;
    y = 1.1F * x + 1.7F * y + 9.1F;
    x = turned;
  }
  return sum;  // 0 to 1, mean 0.5
}

// The sky behind a layer of flat clouds.
Eigen::Vector3f clouded(const Eigen::Vector3f& d, const Eigen::Vector3f& sky) {
  const float distance = 1.0F / (d.z() + 0.12F);
  const float x = 1.3F * d.x() * distance;
  const float y = 1.3F * d.y() * distance;
  const float density = cloud_noise(x, y);
  const float thickness = smooth_step(0.46F, 0.75F, density);
  const float cover = std::min(1.0F, 1.6F * thickness) * smooth_step(0.01F, 0.1F, d.z());
  const float bright = 2.6F - 1.1F * smooth_step(0.5F, 0.8F, cloud_noise(x + 0.15F, y + 0.1F));
  return sky + cover * (bright * Eigen::Vector3f(1.0F, 1.0F, 1.03F) - sky);
}

Eigen::Vector3f sky_color(const Eigen::Vector3f& d, const Lighting& lighting) {
  const float height = std::max(d.z(), 0.0F);
  const Eigen::Vector3f zenith(0.42F, 0.66F, 1.15F);
  const Eigen::Vector3f horizon(1.35F, 1.48F, 1.62F);
  const float fade = std::pow(1.0F - height, 4.0F);
  Eigen::Vector3f sky = zenith + fade * (horizon - zenith);
  if (!(lighting.sun > 0.0F)) return sky;  // indoors there is no sky
  const float toward_sun = std::max(0.0F, d.dot(lighting.to_sun));
  const float glow = 0.7F * std::pow(toward_sun, 8.0F) + 4.0F * std::pow(toward_sun, 350.0F);
  sky += glow * Eigen::Vector3f(1.0F, 0.93F, 0.8F);
  return clouded(d, sky);
}

// Inverse of the stereographic projection of the unit disc.
Eigen::Vector3f direction_of(int column, int row) {
  const float x = 2.0F * static_cast<float>(column) / (kSize - 1) - 1.0F;
  const float y = 2.0F * static_cast<float>(row) / (kSize - 1) - 1.0F;
  const float r2 = x * x + y * y;
  const float scale = 1.0F / (1.0F + r2);
  Eigen::Vector3f d(2.0F * x * scale, 2.0F * y * scale, (1.0F - r2) * scale);
  if (d.z() < 0.0F) d = Eigen::Vector3f(d.x(), d.y(), 0.0F).normalized();  // the square's corners
  return d;
}

// Between a texel and its neighbours to the right and below.
float bilinear(const float* texel, float x, float y) {
  const float low = texel[0] + x * (texel[1] - texel[0]);
  const float high = texel[kSize] + x * (texel[kSize + 1] - texel[kSize]);
  return low + y * (high - low);
}

}  // namespace

Sky::Sky(const Lighting& lighting) {
  std::vector<Eigen::Vector3f> colors;
  colors.reserve(static_cast<std::size_t>(kSize) * kSize);
  for (int row = 0; row < kSize; ++row)
    for (int column = 0; column < kSize; ++column)
      colors.push_back(sky_color(direction_of(column, row), lighting));
  Eigen::Vector3f haze = Eigen::Vector3f::Zero();
  float irradiance = 0.0F;
  float weight = 0.0F;
  float horizon_weight = 0.0F;
  constexpr int kStep = 8;
  for (int row = 0; row < kSize; row += kStep) {
    for (int column = 0; column < kSize; column += kStep) {
      const Eigen::Vector3f d = direction_of(column, row);
      const float solid_angle =
          (1.0F + d.z()) * (1.0F + d.z());  // solid angle of a texel, up to a factor
      const Eigen::Vector3f& color = colors[static_cast<std::size_t>(row * kSize + column)];
      irradiance += solid_angle * d.z() * luminance_of(color);
      weight += solid_angle * d.z();
      if (d.z() > 0.15F) continue;
      haze += color;
      horizon_weight += 1.0F;
    }
  }
  const float scale = lighting.ambient * weight / irradiance;
  haze *= scale / horizon_weight;
  haze_luminance_ = luminance_of(haze);
  luminance_.reserve(colors.size());
  for (const Eigen::Vector3f& color : colors)
    luminance_.push_back(luminance_of(Eigen::Vector3f(color * scale)));
}

inline Sky::Cell Sky::cell_of(float dx, float dy, float dz) {
  const float z = std::max(dz, 0.0F);
  const float length = std::sqrt(dx * dx + dy * dy + z * z);
  const float scale = length > 0.0F ? 1.0F / (length + z) : 0.0F;
  constexpr float kHalf = 0.5F * (kSize - 1);
  constexpr float kMost = kSize - 1.001F;
  const float x = std::min(std::max(kHalf * (dx * scale + 1.0F), 0.0F), kMost);
  const float y = std::min(std::max(kHalf * (dy * scale + 1.0F), 0.0F), kMost);
  const auto column = static_cast<std::int32_t>(x);
  const auto row = static_cast<std::int32_t>(y);
  return {row * kSize + column, x - static_cast<float>(column), y - static_cast<float>(row)};
}

float Sky::luminance(const Eigen::Vector3f& direction) const {
  const Cell c = cell_of(direction.x(), direction.y(), direction.z());
  return bilinear(luminance_.data() + c.index, c.x, c.y);
}

Lanes Sky::luminance(const Lanes3& directions) const {
  Lanes result;
  run_wide([&] {
    IntLanes index;
    Lanes x;
    Lanes y;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const Cell c = cell_of(directions.x[i], directions.y[i], directions.z[i]);
      index[i] = c.index;
      x[i] = c.x;
      y[i] = c.y;
    }
    for (std::size_t i = 0; i < kLanes; ++i)
      result[i] = bilinear(luminance_.data() + index[i], x[i], y[i]);
  });
  return result;
}

}  // namespace km
