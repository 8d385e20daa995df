#include "modules/simulation/rendering/lens_blur.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace km {
namespace {

std::vector<float> gaussian_kernel(double sigma_px) {
  const int radius = static_cast<int>(std::ceil(3.0 * sigma_px));
  std::vector<float> kernel;
  float sum = 0.0F;
  for (int i = -radius; i <= radius; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
    sum += kernel.back();
  }
  for (float& weight : kernel) weight /= sum;
  return kernel;
}

/// `row` convolved; `padded` is scratch memory.
template <typename Value>
void blur_row(const std::vector<float>& kernel, const Value* row, std::size_t n,
              std::vector<Value>& padded, Value* result) {
  const std::size_t radius = kernel.size() / 2;
  padded.assign(radius, row[0]);
  padded.insert(padded.end(), row, row + n);
  padded.insert(padded.end(), radius, row[n - 1]);
  for (std::size_t x = 0; x < n; ++x) result[x] = kernel[0] * padded[x];
  for (std::size_t i = 1; i < kernel.size(); ++i)
    for (std::size_t x = 0; x < n; ++x) result[x] += kernel[i] * padded[x + i];
}

}  // namespace

template <typename Value>
std::vector<Value> lens_blurred(const std::vector<Value>& image, int width, int height,
                                double sigma_px) {
  constexpr double kSharp_px = 0.1;  // the neighbours' weights round to zero
  if (!(sigma_px > kSharp_px) || image.empty()) return image;
  const std::vector<float> kernel = gaussian_kernel(sigma_px);
  const auto n = static_cast<std::size_t>(width);
  const int radius = static_cast<int>(kernel.size() / 2);
  std::vector<Value> across(image.size());
  std::vector<Value> padded;
  for (std::size_t begin = 0; begin < image.size(); begin += n)
    blur_row(kernel, image.data() + begin, n, padded, across.data() + begin);
  std::vector<Value> result(image.size());
  for (int y = 0; y < height; ++y) {
    Value* const out = result.data() + static_cast<std::size_t>(y) * n;
    for (int i = -radius; i <= radius; ++i) {
      const auto row = static_cast<std::size_t>(std::clamp(y + i, 0, height - 1));
      const float weight = kernel[static_cast<std::size_t>(i + radius)];
      const Value* const in = across.data() + row * n;
      if (i == -radius) {
        for (std::size_t x = 0; x < n; ++x) out[x] = weight * in[x];
      } else {
        for (std::size_t x = 0; x < n; ++x) out[x] += weight * in[x];
      }
    }
  }
  return result;
}

template std::vector<float> lens_blurred(const std::vector<float>&, int, int, double);
template std::vector<Eigen::Vector3f> lens_blurred(const std::vector<Eigen::Vector3f>&, int, int,
                                                   double);

}  // namespace km
