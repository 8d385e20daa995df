#include "dense_stereo.hpp"

#include <cmath>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace km {
namespace {

constexpr int kDisparities = 128;
constexpr float kDisparityUnits = 16.0F;  // of OpenCV's fixed point
constexpr float kEdge_px = 1.0F;

cv::Mat intrinsics(const PinholeCamera& camera) {
  return (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
}

cv::Mat as_mat(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

class DenseStereo {
 public:
  explicit DenseStereo(const StereoRig& rig) : left_(rig.cameras[0]) {
    const auto& [left, right] = rig.cameras;
    const cv::Size size(left.width, left.height);
    const SE3 T_right_left = rig.T_left_right().inverse();
    cv::Mat R, t, R1, R2, P1, P2, Q;
    cv::eigen2cv(Eigen::Matrix3d(T_right_left.linear()), R);
    cv::eigen2cv(Eigen::Vector3d(T_right_left.translation()), t);
    cv::stereoRectify(intrinsics(left), left.distortion, intrinsics(right), right.distortion, size,
                      R, t, R1, R2, P1, P2, Q, cv::CALIB_ZERO_DISPARITY, 0.0);
    cv::initUndistortRectifyMap(intrinsics(left), left.distortion, R1, P1, size, CV_32FC1, maps_[0],
                                maps_[1]);
    cv::initUndistortRectifyMap(intrinsics(right), right.distortion, R2, P2, size, CV_32FC1,
                                maps_[2], maps_[3]);
    cv::cv2eigen(R1, R_rect_left_);
    focal_px_ = P1.at<double>(0, 0);
    centre_ = {P1.at<double>(0, 2), P1.at<double>(1, 2)};
    focal_baseline_ = -P2.at<double>(0, 3);
    matcher_ = cv::StereoSGBM::create(0, kDisparities, 5, 8 * 25, 32 * 25, 1, 31, 10, 100, 2,
                                      cv::StereoSGBM::MODE_SGBM_3WAY);
  }

  [[nodiscard]] DepthImage depth(const StereoFrame& frame) const {
    cv::Mat left, right, disparity;
    cv::remap(as_mat(frame.left), left, maps_[0], maps_[1], cv::INTER_LINEAR);
    cv::remap(as_mat(frame.right), right, maps_[2], maps_[3], cv::INTER_LINEAR);
    matcher_->compute(left, right, disparity);
    DepthImage result{left_.width, left_.height, {}};
    for (int y = 0; y < left_.height; ++y)
      for (int x = 0; x < left_.width; ++x)
        result.millimetres.push_back(millimetres(disparity, Eigen::Vector2d(x, y)));
    return result;
  }

 private:
  // Of a pixel of the raw image: bilinear in the disparities around its rectified place.
  [[nodiscard]] std::uint16_t millimetres(const cv::Mat& disparity,
                                          const Eigen::Vector2d& px) const {
    const auto bearing = left_.unproject(px);
    if (!bearing) return 0;
    const Eigen::Vector3d ray = R_rect_left_ * bearing->homogeneous();
    const Eigen::Vector2d at = focal_px_ * ray.hnormalized() + centre_;
    const int x0 = static_cast<int>(std::floor(at.x())), y0 = static_cast<int>(std::floor(at.y()));
    if (x0 < 0 || y0 < 0 || x0 + 1 >= disparity.cols || y0 + 1 >= disparity.rows) return 0;
    double sum = 0.0;
    float least = 1e9F, most = 0.0F;
    for (int y = y0; y <= y0 + 1; ++y)
      for (int x = x0; x <= x0 + 1; ++x) {
        const float d = static_cast<float>(disparity.at<std::int16_t>(y, x)) / kDisparityUnits;
        least = std::min(least, d), most = std::max(most, d);
        sum += (1.0 - std::abs(at.x() - x)) * (1.0 - std::abs(at.y() - y)) * static_cast<double>(d);
      }
    if (least < 0.5F || most - least > kEdge_px) return 0;
    // z along the rectified axis; the left camera's differs by the turn between the two.
    const double z_m = focal_baseline_ / sum / ray.z();
    return z_m < 65.0 ? static_cast<std::uint16_t>(std::lround(1e3 * z_m)) : std::uint16_t{0};
  }

  PinholeCamera left_;
  cv::Mat maps_[4];
  Eigen::Matrix3d R_rect_left_;
  double focal_px_ = 0.0, focal_baseline_ = 0.0;
  Eigen::Vector2d centre_;
  cv::Ptr<cv::StereoSGBM> matcher_;
};

}  // namespace

Recording as_rgbd(const Recording& recording, std::size_t every, std::size_t first) {
  const DenseStereo stereo(recording.rig.stereo);
  Recording rgbd = recording;
  rgbd.rig.stereo = rgbd_rig(recording.rig.stereo.cameras[0], recording.rig.stereo.baseline_m());
  rgbd.rig.depth = DepthRange{};
  for (std::size_t k = 0; k < rgbd.packets.size(); ++k) {
    SensorPacket& packet = rgbd.packets[k];
    StereoFrame frame{packet.frame->stamp, packet.frame->left, {}};
    if (k % every == first)
      frame.depth = std::make_shared<const DepthImage>(stereo.depth(*packet.frame));
    packet.frame = std::make_shared<const StereoFrame>(std::move(frame));
  }
  return rgbd;
}

}  // namespace km
