#include "apps/lab/simulation/world/texture.hpp"

#include <algorithm>
#include <bit>

namespace km {
namespace {

const Eigen::Vector3f kRec709{0.2126F, 0.7152F, 0.0722F};

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
  log_size_ = std::countr_zero(static_cast<unsigned>(size));
  float brightest = 0.0F;
  float brightest_channel = 0.0F;
  for (const Eigen::Vector3f& texel : rgb) {
    brightest = std::max(brightest, texel.dot(kRec709));
    brightest_channel = std::max(brightest_channel, texel.maxCoeff());
  }
  constexpr float kDarkest = 1e-6F;  // black: any step will do
  luminance_scale_ = std::max(brightest, kDarkest) / 255.0F;
  luminance_.reserve(rgb.size() * 4 / 3 + 1);
  append_level(size, rgb);
  std::vector<Eigen::Vector3f> level = rgb;
  for (int n = size; n > 1; n /= 2) {
    level = halved(n, level);
    append_level(n / 2, level);
  }
  const float color_scale = std::max(brightest_channel, kDarkest) / 255.0F;
  mean_color_ = level.front().unaryExpr([color_scale](float channel) {
    return color_scale * static_cast<float>(quantized(channel, color_scale));
  });
}

void Texture::append_level(int n, const std::vector<Eigen::Vector3f>& rgb) {
  std::vector<std::uint32_t> grey(rgb.size());
  for (std::size_t i = 0; i < rgb.size(); ++i)
    grey[i] = quantized(rgb[i].dot(kRec709), luminance_scale_);
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

}  // namespace km
