#include "modules/dense_sensing/stereo_depth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <opencv2/imgproc.hpp>

namespace km {
namespace {

Camera shrunk(Camera camera, int factor) {
  camera.width /= factor;
  camera.height /= factor;
  camera.fx /= factor;
  camera.fy /= factor;
  // Pixel centres are whole numbers: pixel 0 of the smaller image is the mean of the first ones.
  camera.cx = (camera.cx + 0.5) / factor - 0.5;
  camera.cy = (camera.cy + 0.5) / factor - 0.5;
  return camera;
}

constexpr int kHalf = 3;  // the window has 7 x 7 pixels
constexpr int kSteps = 16;
constexpr float kMaxMove_px = 0.5F;
constexpr float kMinTexture = 4.0F;  // mean squared gradient in the window [grey levels^2 / px^2]

// The images disagree in a window if the rest of their difference exceeds both the noise (standard
// deviation) and this share of the left image's variance.
constexpr float kNoise = 5.0F;  // [grey levels]
constexpr float kMaxRest = 0.4F;

// Sums over the pixels of a window that have a disparity. g: gradient of the right image along the
// row [grey levels / 32 px], e: right minus left [grey levels / 16], l: left. Running sums of
// integers have no rounding errors.
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

// Fills `row` with the sums over windows of one pixel, for each pixel of an image row.
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

// `disparity` moved to the best agreement of the window, up to a difference in brightness common to
// all its pixels; 0 if the images disagree there.
float refined(float disparity, const Sums& w) {
  if (w.n == 0) return disparity;  // no pixel of the window can be compared
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

// Disparities [px], 32-bit floats, refined so that the left image agrees best with the right one
// shifted by them. The refinement is one Gauss-Newton step on the squared difference in a window
// around each pixel, up to a constant difference in brightness. Moves of more than half a pixel,
// and moves in windows without texture, are not made.
//
// `steps` is the output of OpenCV's matchers in sixteenths of a pixel, not positive if there is
// none. The result is 0 there, and where both images have texture but disagree in the window. Both
// images are 8-bit grey of the same size as `steps`.
cv::Mat refined_disparities(const cv::Mat& left, const cv::Mat& right, const cv::Mat& steps) {
  const int width = steps.cols, height = steps.rows;
  const auto columns_count = static_cast<std::size_t>(width);
  constexpr std::size_t kRows = 2 * kHalf + 1;
  // The rows of the window, and their sum per column. Both move down with the window.
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

constexpr int kDisparityUnit = 16;  // the number of searched disparities is a multiple of it

StereoDepthConfig checked_depths(StereoDepthConfig config) {
  config = checked(config);
  if (!(config.min_depth_m < config.max_depth_m))
    throw ConfigError("stereo_depth.min_depth_m is not below max_depth_m\n");
  return config;
}

int whole_units(double disparity_px) {
  return kDisparityUnit * static_cast<int>(std::ceil((disparity_px + 1.0) / kDisparityUnit));
}

int disparity_count(const StereoRectification& rectification, const StereoDepthConfig& config) {
  const double nearest_px =
      rectification.camera().fx * rectification.baseline_m() / config.min_depth_m;
  return whole_units(std::min(nearest_px, 0.5 * rectification.camera().width));
}

// The smoothness penalties are those that OpenCV's documentation proposes, for one channel.
cv::Ptr<cv::StereoSGBM> make_matcher(int disparities, int speckle_px) {
  constexpr int kBlock_px = 5;         // side of the compared blocks, odd
  constexpr int kMaxLeftRight_px = 1;  // from the disparity matched from the right image
  constexpr int kPrefilterCap = 31;
  constexpr int kUniqueness_percent = 8;  // margin of the best match over all others
  constexpr int kSpeckleStep_px = 1;
  constexpr int kArea = kBlock_px * kBlock_px;
  return cv::StereoSGBM::create(0, disparities, kBlock_px, 8 * kArea, 32 * kArea, kMaxLeftRight_px,
                                kPrefilterCap, kUniqueness_percent, speckle_px, kSpeckleStep_px,
                                cv::StereoSGBM::MODE_SGBM_3WAY);
}

constexpr int kSpeckle_px = 300;  // smaller areas of similar depth are wrong matches
constexpr int kPreviewScale = 4;

// The matcher's disparities for all columns. It compares only columns beyond the number of searched
// disparities, therefore both images get as many more at the left.
cv::Mat matched(const cv::Mat& left, const cv::Mat& right, cv::StereoSGBM& matcher) {
  const int columns = matcher.getNumDisparities();
  std::array<cv::Mat, 2> wide;
  cv::copyMakeBorder(left, wide[0], 0, 0, columns, 0, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(right, wide[1], 0, 0, columns, 0, cv::BORDER_REPLICATE);
  cv::Mat steps;
  matcher.compute(wide[0], wide[1], steps);
  steps = steps.colRange(columns, steps.cols);
  for (int y = 0; y < steps.rows; ++y) {
    auto* row = steps.ptr<std::int16_t>(y);
    for (int x = 0; x < std::min(columns, steps.cols); ++x)
      if (row[x] > kSteps * x) row[x] = 0;
  }
  return steps;
}

}  // namespace

StereoRectification::StereoRectification(const StereoRig& rig, int downscale)
    : full_(rig, Rectification::Centre::kImage),
      camera_(shrunk(full_.camera(), downscale)),
      baseline_m_(rig.baseline_m()),
      seen_(cv::Mat::zeros(camera_.height, camera_.width, CV_8UC1)) {
  for (int y = 0; y < camera_.height; ++y)
    for (int x = 0; x < camera_.width; ++x) {
      const Eigen::Vector3d ray((x - camera_.cx) / camera_.fx, (y - camera_.cy) / camera_.fy, 1.0);
      const auto pixel = seen_pixel(rig.cameras[0], full_.R_left_rect() * ray);
      seen_.at<std::uint8_t>(y, x) = pixel ? 255 : 0;
      left_pixel_.push_back(pixel ? static_cast<std::int32_t>(std::lround(pixel->y())) *
                                            rig.cameras[0].width +
                                        static_cast<std::int32_t>(std::lround(pixel->x()))
                                  : kOutside);
    }
}

cv::Mat StereoRectification::rectified(const GrayImage& image, std::size_t side) const {
  cv::Mat full = full_.rectified(image, side);
  if (full.size() == seen_.size()) return full;
  cv::Mat small;
  const int factor = full.cols / camera_.width;
  cv::resize(full(cv::Rect(0, 0, camera_.width * factor, camera_.height * factor)), small,
             seen_.size(), 0.0, 0.0, cv::INTER_AREA);
  return small;
}

StereoDepth::StereoDepth(const StereoRig& rig, const StereoDepthConfig& config)
    : config_(checked_depths(config)),
      rectification_(rig, config_.downscale),
      disparities_(disparity_count(rectification_, config_)),
      matcher_(make_matcher(disparities_, kSpeckle_px)),
      preview_(make_matcher(whole_units(disparities_ / kPreviewScale),
                            kSpeckle_px / (kPreviewScale * kPreviewScale))) {}

int StereoDepth::largest_disparity(const cv::Mat& left, const cv::Mat& right) const {
  constexpr std::size_t kPixels = 30;  // with a larger disparity
  std::array<cv::Mat, 2> small;
  const cv::Size size(left.cols / kPreviewScale, left.rows / kPreviewScale);
  cv::resize(left, small[0], size, 0.0, 0.0, cv::INTER_AREA);
  cv::resize(right, small[1], size, 0.0, 0.0, cv::INTER_AREA);
  const cv::Mat steps = matched(small[0], small[1], *preview_);
  std::vector<std::int16_t> sorted(steps.begin<std::int16_t>(), steps.end<std::int16_t>());
  if (sorted.size() <= kPixels) return disparities_;
  const auto largest = sorted.begin() + kPixels;
  std::ranges::nth_element(sorted, largest, std::greater());
  return kPreviewScale * std::max<int>(*largest, 0) / kSteps;
}

DepthImage StereoDepth::compute(const GrayImage& left, const GrayImage& right) {
  const cv::Mat rectified_left = rectification_.rectified(left, 0);
  const cv::Mat rectified_right = rectification_.rectified(right, 1);
  constexpr double kMargin_px = 2.0 * kPreviewScale;
  const double wanted = largest_disparity(rectified_left, rectified_right) + kMargin_px;
  matcher_->setNumDisparities(std::clamp(whole_units(wanted), kDisparityUnit, disparities_));
  const cv::Mat steps = matched(rectified_left, rectified_right, *matcher_);
  DepthImage depth{camera().width, camera().height, {}};
  fill(refined_disparities(rectified_left, rectified_right, steps), depth);
  return depth;
}

void StereoDepth::fill(const cv::Mat& disparities_px, DepthImage& depth) const {
  const auto depth_of_one_px = static_cast<float>(1e3 * camera().fx * rectification_.baseline_m());
  const auto min_mm = static_cast<float>(1e3 * config_.min_depth_m);
  const auto max_mm = static_cast<float>(1e3 * config_.max_depth_m);
  depth.millimetres.reserve(disparities_px.total());
  for (int y = 0; y < disparities_px.rows; ++y) {
    const auto* disparity = disparities_px.ptr<float>(y);
    const auto* seen = rectification_.seen().ptr(y);
    for (int x = 0; x < disparities_px.cols; ++x) {
      const float z_mm = depth_of_one_px / disparity[x];  // infinite without a disparity
      const bool used = seen[x] != 0 && min_mm <= z_mm && z_mm <= max_mm;
      depth.millimetres.push_back(used ? static_cast<std::uint16_t>(z_mm + 0.5F) : 0);
    }
  }
}

}  // namespace km
