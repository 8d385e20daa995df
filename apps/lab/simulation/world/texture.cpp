#include "apps/lab/simulation/world/texture.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

const Eigen::Vector3f kRec709{0.2126F, 0.7152F, 0.0722F};

void require_valid(int size, const std::vector<Eigen::Vector3f>& rgb, int max_size) {
  if (size < 1 || size > max_size || !std::has_single_bit(static_cast<unsigned>(size))) {
    throw std::invalid_argument("texture: size " + std::to_string(size) +
                                " is no power of two from 1 to " + std::to_string(max_size));
  }
  const auto wanted = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  if (rgb.size() != wanted) {
    throw std::invalid_argument("texture: " + std::to_string(rgb.size()) + " texels given, " +
                                std::to_string(wanted) + " needed");
  }
  for (const Eigen::Vector3f& texel : rgb) {
    if (!((texel.array() >= 0.0F).all() && (texel.array() <= 1.0F).all())) {  // also NaN
      throw std::invalid_argument("texture: an albedo of (" + std::to_string(texel.x()) + ", " +
                                  std::to_string(texel.y()) + ", " + std::to_string(texel.z()) +
                                  ") is outside [0, 1]");
    }
  }
}

/// Each texel of the next level is the mean of four.
std::vector<Eigen::Vector3f> halved(int n, const std::vector<Eigen::Vector3f>& rgb) {
  const auto width = static_cast<std::size_t>(n);
  std::vector<Eigen::Vector3f> half;
  half.reserve(rgb.size() / 4);
  for (std::size_t y = 0; y < width; y += 2) {
    for (std::size_t x = 0; x < width; x += 2) {
      const std::size_t i = y * width + x;
      half.push_back(0.25F * (rgb[i] + rgb[i + 1] + rgb[i + width] + rgb[i + width + 1]));
    }
  }
  return half;
}

std::uint32_t quantized(float value, float step) {
  return static_cast<std::uint32_t>(std::min(value / step + 0.5F, 255.0F));
}

}  // namespace

Texture::Texture(int size, const std::vector<Eigen::Vector3f>& rgb) {
  require_valid(size, rgb, 1 << kMaxLogSize);
  log_size_ = std::countr_zero(static_cast<unsigned>(size));
  float brightest = 0.0F;
  float brightest_channel = 0.0F;
  for (const Eigen::Vector3f& texel : rgb) {
    brightest = std::max(brightest, texel.dot(kRec709));
    brightest_channel = std::max(brightest_channel, texel.maxCoeff());
  }
  constexpr float kDarkest = 1e-6F;  // black: any step will do
  luminance_scale_ = std::max(brightest, kDarkest) / 255.0F;
  color_scale_ = std::max(brightest_channel, kDarkest) / 255.0F;

  luminance_.reserve(rgb.size() * 4 / 3 + 1);
  color_.reserve(rgb.size() * 4 / 3 + 1);
  append_level(size, rgb);
  std::vector<Eigen::Vector3f> level = rgb;
  for (int n = size; n > 1; n /= 2) {
    level = halved(n, level);
    append_level(n / 2, level);
  }
}

void Texture::append_level(int n, const std::vector<Eigen::Vector3f>& rgb) {
  const auto level = log_size_ - std::countr_zero(static_cast<unsigned>(n));
  level_begin_[static_cast<std::size_t>(level)] = static_cast<std::uint32_t>(color_.size());
  std::vector<std::uint32_t> grey(rgb.size());
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    grey[i] = quantized(rgb[i].dot(kRec709), luminance_scale_);
    color_.push_back(quantized(rgb[i].x(), color_scale_) |
                     quantized(rgb[i].y(), color_scale_) << 8 |
                     quantized(rgb[i].z(), color_scale_) << 16);
  }
  const auto width = static_cast<std::size_t>(n);
  for (std::size_t y = 0; y < width; ++y) {
    const std::size_t row = y * width;
    const std::size_t next_row = (y + 1) % width * width;
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t next = (x + 1) % width;
      luminance_.push_back(grey[row + x] | grey[row + next] << 8 | grey[next_row + x] << 16 |
                           grey[next_row + next] << 24);
    }
  }
}

Texture::LevelBlend Texture::blend_of(float footprint) const {
  const float texels = footprint * static_cast<float>(1 << log_size_);
  if (!(texels > 1.0F)) return {};
  const auto bits = std::bit_cast<std::uint32_t>(texels);
  const int level = static_cast<int>(bits >> 23) - 127;  // the exponent: floor(log2(texels))
  if (level >= log_size_) return {log_size_, log_size_, 0.0F};
  const float mantissa = std::bit_cast<float>((bits & 0x007FFFFFU) | 0x3F800000U);  // 1 to 2
  return {level, level + 1, mantissa - 1.0F};
}

Texture::TilePoint Texture::tile_point(const Eigen::Vector2f& uv) {
  constexpr float kTile = 4294967296.0F;  // 2^32
  const auto wrapped = [](float tiles) {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(tiles * kTile));
  };
  return {wrapped(uv.x()), wrapped(uv.y())};
}

Texture::Cell Texture::cell_of(int log_n, const TilePoint& point) {
  const std::uint32_t half_texel = 0x80000000U >> log_n;
  const std::uint64_t u = static_cast<std::uint64_t>(point.u - half_texel) << log_n;
  const std::uint64_t v = static_cast<std::uint64_t>(point.v - half_texel) << log_n;
  return {static_cast<std::uint32_t>(u >> 32), static_cast<std::uint32_t>(v >> 32),
          static_cast<std::int32_t>(u >> 16 & 0xFFFFU),
          static_cast<std::int32_t>(v >> 16 & 0xFFFFU)};
}

Eigen::Vector3f Texture::bilinear_color(int level, const TilePoint& point) const {
  const int log_n = log_size_ - level;
  const Cell cell = cell_of(log_n, point);
  const std::uint32_t mask = (1U << log_n) - 1U;
  const std::uint32_t* const texels = color_.data() + level_begin_[static_cast<std::size_t>(level)];
  const auto texel = [&](std::uint32_t right, std::uint32_t up) {
    const std::uint32_t packed =
        texels[(((cell.row + up) & mask) << log_n) + ((cell.column + right) & mask)];
    return Eigen::Vector3f(static_cast<float>(packed & 0xFFU),
                           static_cast<float>(packed >> 8 & 0xFFU),
                           static_cast<float>(packed >> 16 & 0xFFU));
  };
  constexpr float kUnit = 1.0F / 65536.0F;
  const float x = kUnit * static_cast<float>(cell.x);
  const float y = kUnit * static_cast<float>(cell.y);
  const Eigen::Vector3f low = (1.0F - x) * texel(0, 0) + x * texel(1, 0);
  const Eigen::Vector3f high = (1.0F - x) * texel(0, 1) + x * texel(1, 1);
  return (1.0F - y) * low + y * high;
}

Eigen::Vector3f Texture::color(const Eigen::Vector2f& uv, float footprint) const {
  const TilePoint point = tile_point(uv);
  const LevelBlend blend = blend_of(footprint);
  const Eigen::Vector3f fine = bilinear_color(blend.fine, point);
  const Eigen::Vector3f coarse = bilinear_color(blend.coarse, point);
  return color_scale_ * ((1.0F - blend.share) * fine + blend.share * coarse);
}

}  // namespace km
