#include "modules/diagnosis/sensor_sample.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>

#include "modules/images/image_view.hpp"
#include "modules/images/keypoint_extractor.hpp"

namespace km {
namespace {

constexpr double kStereoPeriod_s = 0.5, kMinStep_s = 0.09, kMaxStep_s = 0.25;
constexpr int kMaxKeypoints = 800, kFastThreshold = 12;
constexpr float kRatio = 0.8F;
constexpr std::size_t kCorners = 200;
constexpr double kReturns_px = 1.0;
constexpr double kSaturatedLevel = 250.0, kStrongest = 0.99;

struct DescribedImage {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
};

DescribedImage describe(const cv::Mat& image) {
  DescribedImage result;
  make_keypoint_extractor(kMaxKeypoints)
      ->detectAndCompute(image, {}, result.keypoints, result.descriptors);
  return result;
}

// The best match of each row of `a` if it is clearly better than the second best; otherwise -1.
std::vector<int> best_matches(const cv::Mat& a, const cv::Mat& b) {
  std::vector<int> best(static_cast<std::size_t>(a.rows), -1);
  if (a.rows == 0 || b.rows < 2) return best;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(a, b, nearest, 2);
  for (std::size_t i = 0; i < nearest.size(); ++i)
    if (nearest[i][0].distance < kRatio * nearest[i][1].distance) best[i] = nearest[i][0].trainIdx;
  return best;
}

Eigen::Vector2d vector_of(const cv::Point2f& p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y)};
}

StereoMatches match(const DescribedImage& left, const DescribedImage& right) {
  const std::vector<int> there = best_matches(left.descriptors, right.descriptors);
  const std::vector<int> back = best_matches(right.descriptors, left.descriptors);
  StereoMatches matches;
  for (std::size_t i = 0; i < there.size(); ++i) {
    const int j = there[i];
    if (j < 0 || back[static_cast<std::size_t>(j)] != static_cast<int>(i)) continue;
    matches.pairs.push_back({vector_of(left.keypoints[i].pt),
                             vector_of(right.keypoints[static_cast<std::size_t>(j)].pt)});
  }
  return matches;
}

// Shift of the match that is nearest to `point` in the left image.
cv::Point2f shift_near(const StereoMatches& matches, const cv::Point2f& point) {
  const Eigen::Vector2d here = vector_of(point);
  const auto nearest = std::ranges::min_element(
      matches.pairs, {}, [&](const PixelPair& pair) { return (pair.a - here).squaredNorm(); });
  const Eigen::Vector2f shift = (nearest->b - nearest->a).cast<float>();
  return {shift.x(), shift.y()};
}

// 99 % quantile of the gradient magnitudes, by Sobel 3x3 over 8 [levels/px].
double strong_gradient(const cv::Mat& image) {
  cv::Mat dx, dy, magnitude;
  cv::Sobel(image, dx, CV_32F, 1, 0, 3, 1.0 / 8.0);
  cv::Sobel(image, dy, CV_32F, 0, 1, 3, 1.0 / 8.0);
  cv::magnitude(dx, dy, magnitude);
  cv::Mat gradients = magnitude.reshape(0, 1);
  const auto at = static_cast<std::ptrdiff_t>(kStrongest * static_cast<double>(gradients.cols - 1));
  auto* const first = gradients.ptr<float>();
  std::nth_element(first, first + at, first + gradients.cols);
  return static_cast<double>(first[at]);
}

ImageQuality quality_of(const cv::Mat& image) {
  cv::Mat half;
  cv::resize(image, half, {}, 0.5, 0.5, cv::INTER_AREA);
  const double coarse = strong_gradient(half);
  std::vector<cv::KeyPoint> corners;
  cv::FAST(image, corners, kFastThreshold);
  return {.mean_level = cv::mean(image)[0],
          .saturated_share = cv::countNonZero(image >= kSaturatedLevel) /
                             static_cast<double>(std::max<std::size_t>(image.total(), 1)),
          .sharpness = coarse > 0.0 ? strong_gradient(image) / coarse
                                    : std::numeric_limits<double>::quiet_NaN(),
          .corners = corners.size()};
}

ImageSize size_of(const GrayImage& image) {
  return {static_cast<std::uint32_t>(image.width), static_cast<std::uint32_t>(image.height)};
}

const cv::Size kWindow_px(21, 21);
constexpr int kTopLevel = 3;  // levels 0 to 3
constexpr double kCornerQuality = 0.01;
constexpr double kCornerDistance_px = 15.0;

// Tracks points from `from`, starting the search at `to`, and stores the results in `to`; 0: lost.
std::vector<unsigned char> track(const KltImage& a, const KltImage& b,
                                 const std::vector<cv::Point2f>& from,
                                 std::vector<cv::Point2f>& to) {
  std::vector<unsigned char> status;
  std::vector<float> residuals;
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01);
  cv::calcOpticalFlowPyrLK(a.pyramid, b.pyramid, from, to, status, residuals, kWindow_px, kTopLevel,
                           criteria, cv::OPTFLOW_USE_INITIAL_FLOW);
  return status;
}

// Result of tracking a point forward and back.
struct ForwardBackward {
  cv::Point2f to;
  double error_px = 0.0;  // Distance between the start and the point tracked back; infinity: lost.
};

// Copies `image`.
KltImage make_klt_image(const cv::Mat& image) {
  KltImage result;
  result.image = image.clone();
  cv::buildOpticalFlowPyramid(result.image, result.pyramid, kWindow_px, kTopLevel);
  return result;
}

// Tracks points from `a` to `b` and back to `a`. Each search starts at the pixel of the tracked
// point. With `starts_b`, one for each point, the search in `b` starts at these, and the search
// back starts at the original point. This suits views that are far apart, because the search back
// then succeeds if the point is visible.
std::vector<ForwardBackward> forward_backward(const KltImage& a, const KltImage& b,
                                              const std::vector<cv::Point2f>& points,
                                              std::vector<cv::Point2f> starts_b = {}) {
  if (points.empty()) return {};
  const bool far = !starts_b.empty();
  std::vector<cv::Point2f> there = far ? std::move(starts_b) : points;
  const auto there_status = track(a, b, points, there);
  std::vector<cv::Point2f> back = far ? points : there;
  const auto back_status = track(b, a, there, back);
  std::vector<ForwardBackward> tracks(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point2f off = back[i] - points[i];
    const bool lost = there_status[i] == 0 || back_status[i] == 0;
    tracks[i] = {there[i],
                 lost ? std::numeric_limits<double>::infinity() : std::hypot(off.x, off.y)};
  }
  return tracks;
}

// Shi-Tomasi corners, strongest first, quality 0.01, 15 px apart, without a limit on their number.
std::vector<cv::Point2f> corners_of(const cv::Mat& image) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(image, corners, 0, kCornerQuality, kCornerDistance_px);
  return corners;
}

}  // namespace

void SensorSampler::add(const SensorPacket& packet) {
  for (const ImuSample& sample : packet.imu)
    if (sample_.imu.empty() || sample.stamp > sample_.imu.back().stamp)
      sample_.imu.push_back(sample);
  const StereoFrame& frame = *packet.frame;
  if (sample_.frames.empty()) {
    sample_.left_size = size_of(frame.left);
    sample_.right_size = size_of(frame.right);
  }
  sample_.frames.push_back(frame.stamp);
  const cv::Mat left = view(frame.left);
  add_stereo(frame, left);
  add_step(frame, left);
}

void SensorSampler::add_step(const StereoFrame& frame, const cv::Mat& left) {
  const double step_s = seconds_between(last_stamp_, frame.stamp);
  const bool is_first = last_.image.empty();
  if (!is_first && step_s < kMinStep_s) return;
  KltImage image = make_klt_image(left);
  if (!is_first && step_s <= kMaxStep_s) {
    TrackedStep step{.from = last_stamp_, .to = frame.stamp, .points = {}};
    const std::vector<ForwardBackward> tracks = forward_backward(last_, image, corners_);
    for (std::size_t i = 0; i < tracks.size(); ++i)
      if (tracks[i].error_px < kReturns_px)
        step.points.push_back(
            {vector_of(corners_[i]), vector_of(tracks[i].to), right_[i], depths_m_[i]});
    sample_.steps.push_back(std::move(step));
  }
  begin_step(frame, std::move(image));
}

void SensorSampler::begin_step(const StereoFrame& frame, KltImage image) {
  last_ = std::move(image);
  last_stamp_ = frame.stamp;
  corners_ = corners_of(last_.image);  // strongest first
  corners_.resize(std::min(corners_.size(), kCorners));
  right_.assign(corners_.size(), std::nullopt);
  depths_m_.assign(corners_.size(), 0.0);
  for (std::size_t i = 0; i < corners_.size() && frame.depth != nullptr; ++i)
    depths_m_[i] =
        1e-3 * frame.depth->millimetres[static_cast<std::size_t>(std::lround(corners_[i].y)) *
                                            static_cast<std::size_t>(frame.depth->width) +
                                        static_cast<std::size_t>(std::lround(corners_[i].x))];
  if (sample_.stereo.empty() || sample_.stereo.back().pairs.empty()) return;
  std::vector<cv::Point2f> starts;
  for (const cv::Point2f& corner : corners_)
    starts.push_back(corner + shift_near(sample_.stereo.back(), corner));
  const std::vector<ForwardBackward> tracks =
      forward_backward(last_, make_klt_image(view(frame.right)), corners_, std::move(starts));
  for (std::size_t i = 0; i < tracks.size(); ++i)
    if (tracks[i].error_px < kReturns_px) right_[i] = vector_of(tracks[i].to);
}

void SensorSampler::add_stereo(const StereoFrame& frame, const cv::Mat& left) {
  const bool is_first = sample_.qualities.empty();
  if (!is_first && seconds_between(last_stereo_, frame.stamp) < kStereoPeriod_s) return;
  last_stereo_ = frame.stamp;
  if (sample_.qualities.size() >= kMaxStereo) return;
  sample_.qualities.push_back(quality_of(left));
  const DescribedImage orb = describe(left);
  sample_.descriptors.push_back(descriptors_of_rows(orb.descriptors));
  if (frame.right.width > 0) sample_.stereo.push_back(match(orb, describe(view(frame.right))));
}

}  // namespace km
