#include "modules/sensors/rig_completion.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <sstream>
#include <stdexcept>

#include "modules/core/camera/calibration_limits.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/sensors/sensor_messages.hpp"

namespace km {
namespace {

constexpr double kMaxNormError = 1e-3;  // norm of a quaternion

std::string plain(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

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

constexpr const char* kStaticTransforms = "/tf_static";
constexpr const char* kTransforms = "/tf";
constexpr const char* kSide[] = {"left", "right"};

void append(std::string& list, const std::string& item) {
  list += (list.empty() ? "" : "; ") + item;
}

}  // namespace

void StaticTransforms::add(const RosTFMessage& message) {
  for (const RosTransformStamped& transform : message.transforms) {
    const Eigen::Quaterniond& q = transform.transform.rotation;
    if (!(std::abs(q.norm() - 1.0) < kMaxNormError) || !transform.transform.translation.allFinite())
      continue;
    const SE3 T = make_pose(q.normalized().toRotationMatrix(), transform.transform.translation);
    const std::string parent = plain(transform.header.frame_id),
                      child = plain(transform.child_frame_id);
    T_a_b_[parent].insert_or_assign(child, T);
    T_a_b_[child].insert_or_assign(parent, T.inverse());
  }
}

std::optional<SE3> StaticTransforms::find(const std::string& a, const std::string& b) const {
  std::map<std::string, SE3> found = {{plain(a), SE3::Identity()}};  // T_a_frame
  std::deque<std::string> next = {plain(a)};
  for (; !next.empty() && !found.contains(plain(b)); next.pop_front()) {
    const auto neighbours = T_a_b_.find(next.front());
    if (neighbours == T_a_b_.end()) continue;
    const SE3 T_a_frame = found.at(next.front());
    for (const auto& [frame, T] : neighbours->second)
      if (found.emplace(frame, T_a_frame * T).second) next.push_back(frame);
  }
  const auto last = found.find(plain(b));
  return last == found.end() ? std::nullopt : std::optional(last->second);
}

std::string StaticTransforms::frames() const {
  std::string names;
  for (const auto& [frame, neighbours] : T_a_b_)
    names += (names.empty() ? "" : ", ") + readable(frame, 80);
  return names.empty() ? "none" : names;
}

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

RigCompletion::RigCompletion(PartialRig rig) : partial_(std::move(rig)) {
  const SensorTopicNames& topics = partial_.rig.topics;
  if (partial_.checks_depth())
    alignment_.emplace(CameraTopics{topics.left, partial_.info_topics[0]},
                       CameraTopics{topics.depth, partial_.depth_info_topic}, partial_.images[0]);
}

// Topic whose messages contain the name of the body frame.
const std::string& RigCompletion::body_topic() const {
  const SensorTopicNames& topics = partial_.rig.topics;
  if (topics.imu.empty() && topics.gyro.empty()) return topics.odometry;
  return topics.imu.empty() ? topics.gyro : topics.imu;
}

std::vector<RigCompletion::Source> RigCompletion::sources() const {
  std::vector<Source> sources;
  if (!partial_.has_cameras) {
    sources.push_back({partial_.info_topics[0], RosCameraInfo::kType});
    if (has_right()) sources.push_back({partial_.info_topics[1], RosCameraInfo::kType});
  }
  if (!partial_.is_complete())
    sources.push_back({kStaticTransforms, RosTFMessage::kType,
                       !partial_.has_extrinsics && partial_.body_frame.empty()});
  if (!partial_.has_extrinsics) {
    if (partial_.body_frame.empty() && !body_topic().empty())
      sources.push_back({body_topic(), body_topic() == partial_.rig.topics.odometry
                                           ? RosOdometry::kType
                                           : RosImu::kType});
  }
  const SensorTopicNames& topics = partial_.rig.topics;
  if (alignment_ || (!partial_.has_extrinsics && partial_.has_cameras))
    sources.push_back({topics.left, type_of_images(topics.left)});
  if (!alignment_) return sources;
  sources.push_back({topics.depth, type_of_images(topics.depth)});
  sources.push_back({partial_.depth_info_topic, RosCameraInfo::kType, false});
  if (partial_.has_cameras)
    sources.push_back({partial_.info_topics[0], RosCameraInfo::kType, false});
  return sources;
}

bool RigCompletion::take_info(std::size_t camera, const BagChannel& channel,
                              const BagMessage& message) {
  if (infos_[camera]) return false;
  auto info = decode_ros<RosCameraInfo>(channel.encoding, message.bytes);
  if (!info.value) return false;
  try {
    static_cast<void>(camera_of(*info.value, partial_.images[camera]));
    const SE3 T = T_frame_camera(*info.value, partial_.images[camera]);
    const double angle = so3_log(T.linear()).norm();
    constexpr double kRemarkable_rad = 1e-3;
    if (angle > kRemarkable_rad) {
      std::ostringstream note;
      note << channel.topic << ": R turns the camera by " << angle
           << " rad: its frame is taken as that of the rectified camera";
      partial_.rig.notes.push_back(note.str());
    }
  } catch (const std::invalid_argument& error) {
    throw DatasetError(readable(channel.topic, 80) + ": " + error.what());
  }
  infos_[camera] = *std::move(info.value);
  return true;
}

bool RigCompletion::add(const BagChannel& channel, const BagMessage& message) {
  const bool is_new = take_part(channel, message);
  return (alignment_ && alignment_->add(channel, message)) || is_new;
}

void RigCompletion::end() {
  if (alignment_) alignment_->end();
  uses_moving_ = true;
}

std::optional<SE3> RigCompletion::find(const std::string& a, const std::string& b) const {
  const auto T = transforms_.find(a, b);
  return T || !uses_moving_ ? T : moving_.find(a, b);
}

bool RigCompletion::take_part(const BagChannel& channel, const BagMessage& message) {
  const auto take_frame = [&](std::optional<std::string>& frame) {
    if (frame) return false;
    if (is_of_type(channel, RosOdometry::kType)) {
      auto odometry = decode_ros<RosOdometry>(channel.encoding, message.bytes);
      if (odometry.value) frame = std::move(odometry.value->child_frame_id);
      return frame.has_value();
    }
    auto header = decode_ros<RosHeader>(channel.encoding, message.bytes);
    if (header.value) frame = std::move(header.value->frame_id);
    return frame.has_value();
  };
  const bool is_static = channel.topic == kStaticTransforms;
  if ((is_static || channel.topic == kTransforms) && is_of_type(channel, RosTFMessage::kType)) {
    const auto transforms = decode_ros<RosTFMessage>(channel.encoding, message.bytes);
    if (transforms.value && is_static) transforms_.add(*transforms.value);
    if (transforms.value) moving_.add(*transforms.value);
    return transforms.value && (is_static || uses_moving_);
  }
  if (!partial_.has_cameras && is_of_type(channel, RosCameraInfo::kType)) {
    bool is_new = false;
    for (const std::size_t camera : {0U, 1U})
      if (channel.topic == partial_.info_topics[camera])
        is_new = take_info(camera, channel, message) || is_new;
    return is_new;
  }
  if (channel.topic == body_topic()) return take_frame(body_frame_);
  return channel.topic == partial_.rig.topics.left && take_frame(image_frame_);
}

std::optional<std::string> RigCompletion::camera_frame(std::size_t camera) const {
  if (infos_[camera]) return infos_[camera]->header.frame_id;
  return camera == 0 && partial_.has_cameras ? image_frame_ : std::nullopt;
}

std::optional<std::string> RigCompletion::body_frame() const {
  return partial_.body_frame.empty() ? body_frame_ : partial_.body_frame;
}

std::optional<SE3> RigCompletion::T_body_left() const {
  const auto body = body_frame(), left = camera_frame(0);
  if (!body || !left) return std::nullopt;
  const auto T_body_frame = find(*body, *left);
  if (!T_body_frame || !infos_[0]) return T_body_frame;
  return *T_body_frame * T_frame_camera(*infos_[0], partial_.images[0]);
}

// Relative pose of the cameras from the baseline in P, because rectified cameras differ by a
// translation along x. Without a baseline it is that of their frames in /tf_static.
std::optional<SE3> RigCompletion::T_left_right() const {
  if (partial_.has_pair) return partial_.rig.sensors.stereo.T_left_right();
  if (!infos_[0] || !infos_[1]) return std::nullopt;
  std::optional<SE3> T_frames;
  if (const auto baseline = baseline_m(*infos_[1]))
    T_frames = make_pose(Eigen::Matrix3d::Identity(), {*baseline, 0.0, 0.0});
  else
    T_frames = find(*camera_frame(0), *camera_frame(1));
  if (!T_frames) return std::nullopt;
  return T_frame_camera(*infos_[0], partial_.images[0]).inverse() * *T_frames *
         T_frame_camera(*infos_[1], partial_.images[1]);
}

std::optional<Rig> RigCompletion::rig() const {
  const auto misalignment =
      alignment_ ? alignment_->problem(transforms_) : std::optional<std::string>("");
  if (!misalignment) return std::nullopt;
  if (!misalignment->empty()) throw DatasetError(*misalignment);
  Rig rig = partial_.rig;
  StereoRig& stereo = rig.sensors.stereo;
  if (!partial_.has_cameras) {
    const auto T = T_left_right();
    if (!infos_[0] || (has_right() && (!infos_[1] || !T))) return std::nullopt;
    const SE3 T_body_left = stereo.cameras[0].T_body_cam;
    const Camera left = camera_of(*infos_[0], partial_.images[0]);
    stereo = rgbd_rig(left, partial_.virtual_baseline_m);
    if (has_right()) {
      stereo = {.cameras = {left, camera_of(*infos_[1], partial_.images[1])}};
      stereo.cameras[1].T_body_cam = *T;
      if (const auto problem = pair_problem(stereo))
        throw DatasetError(partial_.info_topics[1] + ": " + *problem);
    }
    if (partial_.has_extrinsics)
      for (Camera& camera : stereo.cameras) camera.T_body_cam = T_body_left * camera.T_body_cam;
  }
  if (partial_.has_extrinsics) return rig;
  const auto T = T_body_left();
  if (!T) return std::nullopt;
  if (!transforms_.find(*body_frame(), *camera_frame(0)))
    rig.notes.push_back(
        "the pose of the left camera on the body is that on /tf, because "
        "/tf_static does not have it: it may not move");
  for (Camera& camera : stereo.cameras) camera.T_body_cam = *T * camera.T_body_cam;
  return rig;
}

std::string RigCompletion::missing_chain(const std::string& a, const std::string& b) const {
  const std::string frames = transforms_.frames(), with_moving = moving_.frames();
  return std::string(kStaticTransforms) + " does not join " + readable(a, 80) + " and " +
         readable(b, 80) + ", its frames are: " + frames +
         (with_moving == frames ? "" : "; with " + std::string(kTransforms) + ": " + with_moving);
}

std::string RigCompletion::missing() const {
  std::string list;
  bool has_infos = true;
  for (std::size_t k = 0; k < (has_right() ? 2U : 1U) && !partial_.has_cameras; ++k) {
    if (infos_[k]) continue;
    has_infos = false;
    append(list, std::string("the ") + kSide[k] + " camera: sensor_msgs/CameraInfo on " +
                     partial_.info_topics[k]);
  }
  if (!partial_.has_cameras && has_infos && has_right() && !T_left_right())
    append(list, "pose of the right camera: a baseline in P of " + partial_.info_topics[1] +
                     (infos_[1]->p[3] > 0.0    ? " (its P[3] is positive, and must be negative)"
                      : infos_[1]->p[0] == 0.0 ? " (its P is 0)"
                                               : "") +
                     ", or " + missing_chain(*camera_frame(0), *camera_frame(1)));
  if (partial_.has_extrinsics) return list;
  const auto body = body_frame(), left = camera_frame(0);
  if (!body)
    append(list, "frame of the body: " +
                     (body_topic().empty() ? "" : "frame_id of " + body_topic() + ", or ") +
                     "body_frame in the rig");
  if (!left && partial_.has_cameras)
    append(list, "frame of the left camera: images on " + partial_.rig.topics.left);
  if (!T_body_left())
    append(list, std::string("pose of the left camera on the body: ") +
                     (body && left ? missing_chain(*body, *left) : kStaticTransforms) +
                     " (body_frame names the body's)");
  return list;
}

Rig complete_rig(const std::string& name, BagReader& bag, PartialRig rig) {
  const auto is_absent = [&bag](const std::string& topic) {
    return !bag.is_live() && std::ranges::count(bag.channels(), topic, &BagChannel::topic) == 0;
  };
  // BagDataset names absent topics of images.
  if (is_absent(rig.rig.topics.left) || is_absent(rig.rig.topics.depth))
    rig.is_depth_aligned = true;
  RigCompletion completion(std::move(rig));
  const auto fail = [&] {
    std::string others;
    for (const auto& source : completion.sources())
      for (const BagChannel& channel : bag.channels())
        if (channel.topic == source.topic && !source.type.empty() &&
            !is_of_type(channel, source.type) && !has_images(channel))
          others += "; " + readable(channel.topic, 80) + " has messages of " +
                    readable(channel.type, 80) + ", not of " + std::string(source.type) +
                    ": state its calibration in the rig file";
    throw DatasetError(name +
                       ": the calibration is not complete; name its files in the rig file "
                       "(calibration: ...); missing: " +
                       completion.missing() + others);
  };
  const bool uses_moving = is_absent(kStaticTransforms) && !is_absent(kTransforms);
  if (uses_moving) completion.use_moving_transforms();
  // A recorded bag without a needed topic cannot complete the rig, so no message is read.
  for (const auto& source : completion.sources())
    if (source.is_needed && is_absent(source.topic) &&
        !(uses_moving && source.topic == kStaticTransforms))
      fail();
  auto complete = completion.rig();
  while (!complete) {
    const auto message = bag.next();
    if (!message) {
      completion.end();
      complete = completion.rig();
      if (!complete) fail();
    } else if (completion.add(bag.channels()[message->channel], *message)) {
      complete = completion.rig();
    }
  }
  return *std::move(complete);
}

}  // namespace km
