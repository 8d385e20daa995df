#include "modules/dense_sensing/disparity_refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace km {
namespace {

constexpr int kHalf = 3;  // the window has 7 x 7 pixels
constexpr int kSteps = 16;
constexpr float kMaxMove_px = 0.5F;
constexpr float kMinTexture = 4.0F;  // mean squared gradient in the window [grey levels^2 / px^2]

// The images do not agree in a window where what remains of their difference is more than noise
// (standard deviation) and more than this share of the left image's variance.
constexpr float kNoise = 5.0F;  // [grey levels]
constexpr float kMaxRest = 0.4F;

// What a window sums up over its pixels that have a disparity. g: gradient of the right image along
// the row [grey levels / 32 px], e: right minus left [grey levels / 16], l: left. Whole numbers:
// what goes into a running sum comes out again without a rest.
struct Sums {
  std::int32_t n = 0, g = 0, e = 0, gg = 0, ge = 0, ee = 0, l = 0, ll = 0;

  Sums& operator+=(const Sums& o) {
    n += o.n, g += o.g, e += o.e, gg += o.gg, ge += o.ge, ee += o.ee, l += o.l, ll += o.ll;
    return *this;
  }
  Sums& operator-=(const Sums& o) {
    n -= o.n, g -= o.g, e -= o.e, gg -= o.gg, ge -= o.ge, ee -= o.ee, l -= o.l, ll -= o.ll;
    return *this;
  }
};

// Of every pixel of a row by itself.
void fill_row(const std::uint8_t* left, const std::uint8_t* right, const std::int16_t* steps,
              int width, std::vector<Sums>& row) {
  for (int x = 0; x < width; ++x) {
    Sums& sums = row[static_cast<std::size_t>(x)];
    sums = {};
    const int at = kSteps * x - steps[x];
    const int below = at / kSteps;
    if (steps[x] <= 0 || at < kSteps || below + 2 >= width) continue;
    const int share = at % kSteps;
    const auto between = [&](int i) { return (kSteps - share) * right[i] + share * right[i + 1]; };
    sums.n = 1;
    sums.g = between(below + 1) - between(below - 1);
    sums.e = between(below) - kSteps * left[x];
    sums.gg = sums.g * sums.g;
    sums.ge = sums.g * sums.e;
    sums.ee = sums.e * sums.e;
    sums.l = left[x];
    sums.ll = sums.l * sums.l;
  }
}

// Sum of the products of two quantities' deviations from their means, from their sums.
float spread(std::int32_t product, std::int32_t a, std::int32_t b, float n) {
  return static_cast<float>(product) - static_cast<float>(a) * static_cast<float>(b) / n;
}

// `disparity` moved to where the window agrees best, up to a difference in brightness common to all
// its pixels; 0 if it does not agree there.
float refined(float disparity, const Sums& w) {
  if (w.n == 0) return disparity;  // too near the rim to compare
  const auto n = static_cast<float>(w.n);
  const float texture = spread(w.gg, w.g, w.g, n) / 1024.0F;
  const float match = spread(w.ge, w.g, w.e, n) / 512.0F;
  float rest = spread(w.ee, w.e, w.e, n) / 256.0F;
  float move = texture > kMinTexture * n ? match / texture : 0.0F;
  if (std::abs(move) > kMaxMove_px) move = 0.0F;
  rest += (move * texture - 2.0F * match) * move;
  const bool agrees = rest <= kNoise * kNoise * n || rest <= kMaxRest * spread(w.ll, w.l, w.l, n);
  return agrees ? disparity + move : 0.0F;
}

}  // namespace

cv::Mat refined_disparities(const cv::Mat& left, const cv::Mat& right, const cv::Mat& steps) {
  const int width = steps.cols, height = steps.rows;
  const auto columns_count = static_cast<std::size_t>(width);
  constexpr std::size_t kRows = 2 * kHalf + 1;
  // The rows of the window, and their sum, column by column: both move down with it.
  std::array<std::vector<Sums>, kRows> rows;
  for (auto& row : rows) row.resize(columns_count);
  std::vector<Sums> columns(columns_count);
  cv::Mat result(height, width, CV_32FC1);
  for (int below = 0; below < height + kHalf; ++below) {
    std::vector<Sums>& row = rows[static_cast<std::size_t>(below) % kRows];
    for (std::size_t x = 0; x < columns_count; ++x) columns[x] -= row[x];
    if (below < height)
      fill_row(left.ptr(below), right.ptr(below), steps.ptr<std::int16_t>(below), width, row);
    else
      std::fill(row.begin(), row.end(), Sums{});
    for (std::size_t x = 0; x < columns_count; ++x) columns[x] += row[x];
    const int y = below - kHalf;
    if (y < 0) continue;
    const auto* given = steps.ptr<std::int16_t>(y);
    auto* row_result = result.ptr<float>(y);
    Sums window;
    for (int x = 0; x < kHalf && x < width; ++x) window += columns[static_cast<std::size_t>(x)];
    for (int x = 0; x < width; ++x) {
      if (x + kHalf < width) window += columns[static_cast<std::size_t>(x + kHalf)];
      if (x > kHalf) window -= columns[static_cast<std::size_t>(x - kHalf - 1)];
      row_result[x] = given[x] > 0 ? refined(static_cast<float>(given[x]) / kSteps, window) : 0.0F;
    }
  }
  return result;
}

}  // namespace km
