#include "modules/loop_closure/epipolar_matcher.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace km {
namespace {

// Patch of the search: 16 columns from -8 to +7, one vector register of bytes.
constexpr int kSearchLeft = 8;
constexpr int kSearchColumns = 16;
constexpr int kSearchHalfRows = 5;

// The patch of the refinement: square, symmetric.
constexpr int kHalf = 5;
constexpr int kPatchSize = (2 * kHalf + 1) * (2 * kHalf + 1);

// Least ratio of the cost of any other shift, except for neighbours, to that of the best shift.
constexpr double kUniqueness = 1.15;
constexpr int kNeighbour = 2;               // largest distance of a neighbour [px]
constexpr int kMaxLeftRightDifference = 1;  // between the two directions of search [px]
constexpr double kMaxRefinement_px = 1.5;   // largest change of the disparity by the refinement
constexpr double kLeastCorrelation = 0.8;   // zero-normalised, of left and right patch
constexpr double kMaxRowOffset_px = 1.5;    // remaining violation of the epipolar constraint after
                                            // calibration

// Subtracts the local mean, so that the result does not depend on exposure.
cv::Mat flattened(const cv::Mat& image) {
  cv::Mat mean, difference;
  cv::blur(image, mean, {21, 21});
  cv::subtract(image, mean, difference, cv::noArray(), CV_16S);
  cv::Mat flat;
  difference.convertTo(flat, CV_8U, 1.0, 128.0);
  return flat;
}

unsigned patch_difference(const std::uint8_t* a, const std::uint8_t* b, std::size_t step) {
  unsigned sum = 0;
  for (int row = 0; row <= 2 * kSearchHalfRows; ++row, a += step, b += step)
    for (int c = 0; c < kSearchColumns; ++c)
      sum += static_cast<unsigned>(std::abs(int{a[c]} - int{b[c]}));
  return sum;
}

// Range of a search. A patch of the reference at `column` is compared with the target at
// column - direction * shift, for shift in [first, last].
struct Search {
  int first, last, direction;
};

// Shift with the least sum of absolute differences; nullopt if it is not unique.
std::optional<int> best_shift(const cv::Mat& reference, const cv::Mat& target, cv::Point at,
                              const Search& search) {
  constexpr int kMaxShifts = 1024;
  std::array<unsigned, kMaxShifts> cost;
  const int count = std::min(search.last - search.first + 1, kMaxShifts);
  if (count <= 0) return std::nullopt;
  const std::uint8_t* a = reference.ptr(at.y - kSearchHalfRows) + at.x - kSearchLeft;
  const std::uint8_t* b = target.ptr(at.y - kSearchHalfRows) + at.x - kSearchLeft;
  for (int i = 0; i < count; ++i)
    cost[static_cast<std::size_t>(i)] =
        patch_difference(a, b - search.direction * (search.first + i), reference.step);
  const auto* best = std::min_element(cost.begin(), cost.begin() + count);
  const int index = static_cast<int>(best - cost.begin());
  for (int i = 0; i < count; ++i)
    if (std::abs(i - index) > kNeighbour && cost[static_cast<std::size_t>(i)] < kUniqueness * *best)
      return std::nullopt;
  return search.first + index;
}

// A patch of zero mean and unit norm with its gradients.
struct NormalisedPatch {
  Eigen::Array<float, kPatchSize, 1> value, dx, dy;
  bool textured = false;
};

NormalisedPatch sample(const cv::Mat& image, const Eigen::Vector2d& centre) {
  NormalisedPatch patch;
  const int x0 = static_cast<int>(std::floor(centre.x()));
  const int y0 = static_cast<int>(std::floor(centre.y()));
  const auto ax = static_cast<float>(centre.x() - x0);
  const auto ay = static_cast<float>(centre.y() - y0);
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  const auto mix = [&](const std::uint8_t* p) {
    const float top = static_cast<float>(p[0]) * (1.0F - ax) + static_cast<float>(p[1]) * ax;
    const float low =
        static_cast<float>(p[step]) * (1.0F - ax) + static_cast<float>(p[step + 1]) * ax;
    return top * (1.0F - ay) + low * ay;
  };
  Eigen::Index k = 0;
  for (int r = -kHalf; r <= kHalf; ++r) {
    const std::uint8_t* row = image.ptr(y0 + r) + x0;
    for (int c = -kHalf; c <= kHalf; ++c, ++k) {
      const std::uint8_t* p = row + c;
      patch.value[k] = mix(p);
      patch.dx[k] = 0.5F * (mix(p + 1) - mix(p - 1));
      patch.dy[k] = 0.5F * (mix(p + step) - mix(p - step));
    }
  }
  patch.value -= patch.value.mean();
  const float norm = patch.value.matrix().norm();
  constexpr float kLeastNorm = 2.0F * (2 * kHalf + 1);  // 2 grey levels per pixel
  patch.textured = norm > kLeastNorm;
  patch.value /= norm;
  patch.dx = (patch.dx - patch.dx.mean()) / norm;
  patch.dy = (patch.dy - patch.dy.mean()) / norm;
  return patch;
}

bool inside(const cv::Mat& image, const Eigen::Vector2d& centre) {
  constexpr double kMargin = kHalf + 2;
  return centre.x() >= kMargin && centre.y() >= kMargin && centre.x() < image.cols - kMargin - 1 &&
         centre.y() < image.rows - kMargin - 1;
}

struct Refined {
  Eigen::Vector2d position;
  double correlation = 0.0;
};

// Gauss-Newton on the normalised patches, in both directions of the image.
std::optional<Refined> refine(const NormalisedPatch& reference, const cv::Mat& target,
                              Eigen::Vector2d position) {
  constexpr int kSteps = 6;
  constexpr double kConverged_px = 0.01;
  for (int i = 0;; ++i) {
    if (!inside(target, position)) return std::nullopt;
    const NormalisedPatch patch = sample(target, position);
    if (!patch.textured) return std::nullopt;
    const Eigen::Array<float, kPatchSize, 1> error = reference.value - patch.value;
    Eigen::Matrix2f H;
    H << patch.dx.square().sum(), (patch.dx * patch.dy).sum(), (patch.dx * patch.dy).sum(),
        patch.dy.square().sum();
    const Eigen::Vector2f g((patch.dx * error).sum(), (patch.dy * error).sum());
    H.diagonal().array() += 1e-6F;  // damping for an edge along the row
    const Eigen::Vector2d delta = H.ldlt().solve(g).cast<double>();
    if (delta.norm() < kConverged_px || i == kSteps)
      return Refined{position, (reference.value * patch.value).sum()};
    position += delta.cwiseMax(-1.0).cwiseMin(1.0);
  }
}

}  // namespace

EpipolarMatcher::EpipolarMatcher(const StereoRig& rig, const KeyframeFeaturesConfig& config)
    : config_(checked(config)),
      rectification_(rig, Rectification::Centre::kLeftAxis),
      focal_baseline_(rectification_.camera().fx * rig.baseline_m()) {}

EpipolarMatcher::Rectified EpipolarMatcher::rectify(const StereoFrame& frame) const {
  Rectified images;
  images.left = rectification_.rectified(frame.left, 0);
  images.right = rectification_.rectified(frame.right, 1);
  images.left_flat = flattened(images.left);
  images.right_flat = flattened(images.right);
  return images;
}

float EpipolarMatcher::disparity(const Rectified& images, const Eigen::Vector2d& pixel) const {
  const cv::Point at(static_cast<int>(std::lround(pixel.x())),
                     static_cast<int>(std::lround(pixel.y())));
  if (!inside(images.left, pixel) || at.x < kSearchLeft || at.x + kSearchColumns > images.left.cols)
    return 0.0F;
  const Search leftwards{
      static_cast<int>(focal_baseline_ / config_.max_depth_m),
      std::min(static_cast<int>(focal_baseline_ / config_.min_depth_m) + 1, at.x - kSearchLeft), 1};
  const std::optional<int> shift = best_shift(images.left_flat, images.right_flat, at, leftwards);
  if (!shift) return 0.0F;
  const cv::Point in_right(at.x - *shift, at.y);
  const Search rightwards{leftwards.first,
                          std::min(static_cast<int>(focal_baseline_ / config_.min_depth_m) + 1,
                                   images.left.cols - kSearchLeft - in_right.x),
                          -1};
  const std::optional<int> back =
      best_shift(images.right_flat, images.left_flat, in_right, rightwards);
  if (!back || std::abs(*back - *shift) > kMaxLeftRightDifference) return 0.0F;

  const NormalisedPatch reference = sample(images.left, pixel);
  if (!reference.textured) return 0.0F;
  const Eigen::Vector2d start(pixel.x() - *shift, pixel.y());
  const std::optional<Refined> refined = refine(reference, images.right, start);
  if (!refined || !(refined->correlation >= kLeastCorrelation)) return 0.0F;
  const Eigen::Vector2d moved = refined->position - start;
  if (!(std::abs(moved.x()) <= kMaxRefinement_px && std::abs(moved.y()) <= kMaxRowOffset_px))
    return 0.0F;
  return static_cast<float>(pixel.x() - refined->position.x());
}

std::vector<float> EpipolarMatcher::inverse_depths(
    const StereoFrame& frame, std::span<const Eigen::Vector2f> bearings) const {
  const Rectified images = rectify(frame);
  const Camera& camera = rectification_.camera();
  const Eigen::Matrix3d R_rect_left = rectification_.R_left_rect().transpose();
  std::vector<float> result(bearings.size(), 0.0F);
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    const Eigen::Vector3d ray = R_rect_left * bearings[i].cast<double>().homogeneous();
    const auto pixel = camera.project_ray(ray);
    if (!pixel) continue;
    const float d = disparity(images, *pixel);
    // Depth along the rectified axis is f * baseline / d; the ray scales it to the left camera's.
    const double inverse_depth = d * ray.z() / focal_baseline_;
    if (inverse_depth >= 1.0 / config_.max_depth_m && inverse_depth <= 1.0 / config_.min_depth_m)
      result[i] = static_cast<float>(inverse_depth);
  }
  return result;
}

}  // namespace km
