#include "modules/sensors/depth_alignment.hpp"

#include <sstream>

#include "modules/core/lie.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/core/text_table.hpp"
#include "modules/sensors/ros_image.hpp"

namespace km {
namespace {

constexpr double kMaxOffset_px = 0.1;
constexpr double kMaxOffset_m = 1e-3;
constexpr double kMaxTurn_rad = 1e-3;
// Drivers publish a CameraInfo with every image. After this number of images without one, there is
// none.
constexpr std::size_t kImagesWithoutInfo = 10;

// Focal lengths and principal point, of raw or rectified images.
Eigen::Vector4d intrinsics(const RosCameraInfo& info, RosImages images) {
  const auto& P = info.p;
  const auto& K = info.k;
  return images == RosImages::kRaw ? Eigen::Vector4d(K[0], K[4], K[2], K[5])
                                   : Eigen::Vector4d(P[0], P[5], P[2], P[6]);
}

}  // namespace

bool DepthAlignment::add(const BagChannel& channel, const BagMessage& message) {
  bool is_new = false;
  for (Camera& camera : cameras_) {
    if (channel.topic == camera.topics.info && is_of_type(channel, RosCameraInfo::kType)) {
      auto info = decode_ros<RosCameraInfo>(channel.encoding, message.bytes);
      is_new = is_new || (info.value && !camera.info);
      if (info.value && !camera.info) camera.info = *std::move(info.value);
    }
    if (channel.topic != camera.topics.images || !has_images(channel)) continue;
    ++camera.image_count;
    is_new = true;
    if (!camera.image) camera.image = topic_image(channel, message);
  }
  return is_new;
}

// True while a CameraInfo may still arrive.
bool DepthAlignment::waits_for_info() const {
  const auto& [left, depth] = cameras_;
  return !ended_ && (!left.info || !depth.info) && depth.image_count < kImagesWithoutInfo;
}

std::string DepthAlignment::different_info() const {
  const auto& [left, depth] = cameras_;
  if (!left.info || !depth.info) return "";
  const Eigen::Vector4d a = intrinsics(*left.info, images_), b = intrinsics(*depth.info, images_);
  if (((a - b).cwiseAbs().array() <= kMaxOffset_px).all()) return "";  // not NaN
  std::ostringstream text;
  text << "its CameraInfo has fx, fy, cx, cy of " << b.transpose() << " in place of "
       << a.transpose();
  return text.str();
}

// "": aligned; nullopt: unknown so far.
std::optional<std::string> DepthAlignment::difference(const StaticTransforms& transforms) const {
  const auto& [left, depth] = cameras_;
  if (!left.image || !depth.image) return ended_ ? std::optional<std::string>("") : std::nullopt;
  if (auto size = different_size(*left.image, *depth.image); !size.empty()) return size;
  if (auto info = different_info(); !info.empty()) return info;
  std::string frame = different_frame(*left.image, *depth.image);
  if (!frame.empty()) {
    const auto T = transforms.find(left.image->frame, depth.image->frame);
    const double turn_rad = T ? so3_log(T->linear()).norm() : 0.0;
    if (T && (T->translation().norm() > kMaxOffset_m || turn_rad > kMaxTurn_rad))
      return frame + ", " + fixed(1e3 * T->translation().norm(), 1) + " mm away by /tf_static";
    if (T || (left.info && depth.info)) frame.clear();
  }
  return waits_for_info() ? std::nullopt : std::optional(frame);
}

std::optional<std::string> DepthAlignment::problem(const StaticTransforms& transforms) const {
  auto text = difference(transforms);
  if (!text || text->empty()) return text;
  return misaligned_text(cameras_[0].topics.images, cameras_[1].topics.images, *text);
}

std::string misaligned_text(const std::string& left, const std::string& depth,
                            const std::string& difference) {
  return readable(depth, 80) + ": depth is not aligned with the images of " + readable(left, 80) +
         ": " + difference +
         ". Let the driver align it, and name the topic of aligned depth in the rig file "
         "(RealSense: align_depth.enable:=true makes /camera/camera/aligned_depth_to_color/"
         "image_raw; other drivers: depth registered or transformed to the colour camera). "
         "depth: {aligned: true} in the rig file accepts it as it is";
}

std::string different_size(const TopicImage& left, const TopicImage& depth) {
  if (left.size == ImageSize{} || depth.size == ImageSize{} || left.size == depth.size) return "";
  const auto text = [](const ImageSize& size) {
    return std::to_string(size.width) + 'x' + std::to_string(size.height);
  };
  return "it has " + text(depth.size) + " px in place of " + text(left.size);
}

std::string different_frame(const TopicImage& left, const TopicImage& depth) {
  const bool is_same = StaticTransforms().find(left.frame, depth.frame).has_value();
  if (left.frame.empty() || depth.frame.empty() || is_same) return "";
  return "its frame is " + readable(depth.frame, 80) + ", not " + readable(left.frame, 80);
}

}  // namespace km
