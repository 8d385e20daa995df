#include "modules/evaluation/images/stereo_statistics.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

#include "modules/core/lie.hpp"

namespace km {
namespace {

constexpr int kOrbFeatures = 1000;
constexpr float kRatio = 0.8F;
constexpr double kEpipolarInlier_px = 1.5;
constexpr double kMinDepth_m = 0.3;
constexpr double kMaxDepth_m = 60.0;
constexpr double kKltReturns_px = 1.0;
constexpr int kFastThreshold = 20;
constexpr double kRansacConfidence = 0.999;
constexpr double kLagTolerance_s = 0.03;
constexpr std::size_t kMinMatches = 8;  // enough for a meaningful essential matrix

Eigen::Vector2d vector_of(const cv::Point2f& p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y)};
}

// Matches of a to b whose best distance is clearly better than the second.
std::vector<cv::DMatch> ratio_matches(const cv::Mat& a, const cv::Mat& b) {
  std::vector<cv::DMatch> matches;
  if (a.rows == 0 || b.rows < 2) return matches;
  std::vector<std::vector<cv::DMatch>> best;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(a, b, best, 2);
  for (const auto& pair : best)
    if (pair.size() == 2 && pair[0].distance < kRatio * pair[1].distance)
      matches.push_back(pair[0]);
  return matches;
}

}  // namespace

StereoStatistics::StereoStatistics(const StereoRig& rig)
    : rig_(rig), T_right_left_(rig.T_left_right().inverse()) {}

std::optional<StereoStatistics::StereoMatch> StereoStatistics::judge(
    const cv::Point2f& left, const cv::Point2f& right) const {
  const auto b_left = rig_.cameras[0].unproject(vector_of(left));
  const auto b_right = rig_.cameras[1].unproject(vector_of(right));
  if (!b_left || !b_right) return std::nullopt;
  const Eigen::Vector3d ray_left = b_left->homogeneous();
  const Eigen::Vector3d ray_right = b_right->homogeneous();
  const Eigen::Vector3d& t = T_right_left_.translation();
  const Eigen::Vector3d rotated = T_right_left_.linear() * ray_left;
  const Eigen::Vector3d line = skew(t) * rotated;  // epipolar line of the right image, on z = 1
  StereoMatch match;
  match.epipolar_error_px =
      rig_.cameras[1].fx * std::abs(line.dot(ray_right)) / line.head<2>().norm();
  // Minimises the squared distance of z_right * ray_right = z_left * rotated + t.
  Eigen::Matrix<double, 3, 2> A;
  A << rotated, -ray_right;
  match.depth_m = A.colPivHouseholderQr().solve(-t).x();
  return match;
}

cv::Point2f StereoStatistics::at_infinity(const cv::Point2f& left) const {
  const auto bearing = rig_.cameras[0].unproject(vector_of(left));
  if (!bearing) return left;
  const auto px = rig_.cameras[1].project_ray(T_right_left_.linear() * bearing->homogeneous());
  if (!px) return left;
  return {static_cast<float>(px->x()), static_cast<float>(px->y())};
}

void StereoStatistics::add(Stamp stamp, const KltImage& left, const KltImage& right,
                           const std::vector<cv::Point2f>& corners) {
  std::vector<cv::KeyPoint> fast;
  cv::FAST(left.image, fast, kFastThreshold);
  fast_.push_back(static_cast<double>(fast.size()));

  OrbImage orb{stamp, {}, {}};
  cv::ORB::create(kOrbFeatures)
      ->detectAndCompute(left.image, cv::noArray(), orb.keypoints, orb.descriptors);
  add_later_views(orb);
  if (!right.image.empty()) {
    right_corners_.push_back(static_cast<double>(corners_of(right.image).size()));
    add_orb(orb, right.image);
    add_klt(left, right, corners);
  }
  while (!earlier_.empty() && seconds_between(earlier_.front().stamp, stamp) > lags_.back().lag_s)
    earlier_.pop_front();
  earlier_.push_back(std::move(orb));
}

void StereoStatistics::add_orb(const OrbImage& left, const cv::Mat& right) {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::ORB::create(kOrbFeatures)->detectAndCompute(right, cv::noArray(), keypoints, descriptors);
  const auto matches = ratio_matches(left.descriptors, descriptors);
  int on_line = 0;
  int with_depth = 0;
  for (const cv::DMatch& m : matches) {
    const auto match = judge(left.keypoints[static_cast<std::size_t>(m.queryIdx)].pt,
                             keypoints[static_cast<std::size_t>(m.trainIdx)].pt);
    if (!match || match->epipolar_error_px > kEpipolarInlier_px) continue;
    ++on_line;
    if (match->depth_m < kMinDepth_m || match->depth_m > kMaxDepth_m) continue;
    ++with_depth;
    orb_errors_px_.push_back(match->epipolar_error_px);
  }
  const auto n = static_cast<double>(matches.size());
  orb_matches_.push_back(n);
  orb_with_depth_.push_back(with_depth);
  if (n > 0) orb_shares_.push_back(on_line / n);
}

void StereoStatistics::add_later_views(const OrbImage& left) {
  for (LagFigures& lag : lags_) {
    for (const OrbImage& before : earlier_) {
      const double off_s = seconds_between(before.stamp, left.stamp) - lag.lag_s;
      if (std::abs(off_s) > kLagTolerance_s) continue;
      const auto matches = ratio_matches(before.descriptors, left.descriptors);
      std::vector<cv::Point2d> from, to;
      for (const cv::DMatch& m : matches) {
        const auto& a = before.keypoints[static_cast<std::size_t>(m.queryIdx)].pt;
        const auto& b = left.keypoints[static_cast<std::size_t>(m.trainIdx)].pt;
        const auto bearing_a = rig_.cameras[0].unproject(vector_of(a));
        const auto bearing_b = rig_.cameras[0].unproject(vector_of(b));
        if (!bearing_a || !bearing_b) continue;
        from.emplace_back(bearing_a->x(), bearing_a->y());
        to.emplace_back(bearing_b->x(), bearing_b->y());
      }
      lag.matches.push_back(static_cast<double>(matches.size()));
      if (from.size() < kMinMatches) break;
      cv::Mat inliers;
      cv::findEssentialMat(from, to, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC, kRansacConfidence,
                           kEpipolarInlier_px / rig_.cameras[0].fx, inliers);
      lag.inlier_shares.push_back(cv::countNonZero(inliers) / static_cast<double>(from.size()));
      break;
    }
  }
}

void StereoStatistics::add_klt(const KltImage& left, const KltImage& right,
                               const std::vector<cv::Point2f>& corners) {
  if (corners.empty()) return;
  std::vector<cv::Point2f> starts;
  starts.reserve(corners.size());
  for (const cv::Point2f& corner : corners) starts.push_back(at_infinity(corner));
  const auto tracks = forward_backward(left, right, corners, std::move(starts));
  int passed = 0;
  int on_line = 0;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (tracks[i].error_px >= kKltReturns_px) continue;
    ++passed;
    const auto match = judge(corners[i], tracks[i].to);
    if (!match || match->epipolar_error_px > kEpipolarInlier_px) continue;
    ++on_line;
    klt_errors_px_.push_back(match->epipolar_error_px);
    if (match->depth_m > 0.0) depths_m_.push_back(match->depth_m);
  }
  const auto n = static_cast<double>(corners.size());
  klt_passed_.push_back(passed / n);
  klt_on_line_.push_back(on_line / n);
  klt_matches_.push_back(on_line);
}

void StereoStatistics::append_to(std::vector<ImageFigure>& figures) const {
  FigureList corners(figures, "other corners a frame");
  corners.add("Shi-Tomasi, right, mean", mean_of(right_corners_), 0);
  corners.add_quantiles("Shi-Tomasi, right,", right_corners_, {5, 95}, 0);
  corners.add("FAST at 20, left, mean", mean_of(fast_), 0);

  FigureList orb(figures, "ORB, left to right");
  orb.add("matches", mean_of(orb_matches_), 0);
  orb.add_quantiles("matches", orb_matches_, {5, 95}, 0);
  orb.add("share within 1.5 px of the epipolar line", mean_of(orb_shares_));
  orb.add_quantiles("share within 1.5 px", orb_shares_, {5, 95});
  orb.add("of those with depth 0.3 to 60 m", mean_of(orb_with_depth_), 0);
  orb.add_quantiles("their epipolar error [px]", orb_errors_px_, {50, 90}, 2);

  FigureList later(figures, "ORB, left to left some time later");
  for (const LagFigures& lag : lags_) {
    const std::string time = lag.lag_s < 0.3 ? "0.25 s" : lag.lag_s < 0.7 ? "0.5 s" : "1 s";
    later.add("matches, " + time, mean_of(lag.matches), 0);
    later.add("essential-matrix inliers, " + time, mean_of(lag.inlier_shares));
  }

  FigureList klt(figures, "KLT, left to right");
  klt.add("pass, share of corners", mean_of(klt_passed_));
  klt.add("also within 1.5 px of the epipolar line", mean_of(klt_on_line_));
  klt.add("matches a pair", mean_of(klt_matches_), 0);
  klt.add_quantiles("epipolar error [px]", klt_errors_px_, {50, 90}, 2);
  klt.add_quantiles("depth [m]", depths_m_, {5, 25, 50, 75, 95}, 2);
}

}  // namespace km
