#include "apps/robot/rig_proposal.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>
#include <utility>

#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/rig_completion.hpp"

namespace km {
namespace {

bool has_word(const TopicSummary& topic, std::string_view word) {
  std::string name = topic.topic;
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.find(word) != name.npos;
}

bool is_depth(const TopicSummary& topic) {
  if (!topic.is_image) return false;
  const std::string encoding = topic.image ? topic.image->encoding : "";
  return encoding == "16UC1" || encoding == "32FC1" || has_word(topic, "depth");
}

// Parts of names that mark the left and the right camera.
constexpr std::array<std::pair<const char*, const char*>, 4> kSides = {
    {{"left", "right"}, {"infra1", "infra2"}, {"cam0", "cam1"}, {"cam_0", "cam_1"}}};

bool are_sides(const TopicSummary& left, const TopicSummary& right) {
  return std::ranges::any_of(kSides, [&](const auto& side) {
    return has_word(left, side.first) && has_word(right, side.second);
  });
}

const TopicSummary& named(const std::vector<TopicSummary>& topics, const std::string& name) {
  return *std::ranges::find(topics, name, &TopicSummary::topic);
}

// Prefers two cameras whose names mark them as left and right. Otherwise takes the pair with the
// most common stamps.
void propose_stereo(const std::vector<TopicSummary>& topics, RigFile& rig) {
  std::size_t best = 0;
  for (const TopicPair& pair : pairs_of_images(topics)) {
    const TopicSummary* left = &named(topics, pair.first);
    const TopicSummary* right = &named(topics, pair.second);
    if (is_depth(*left) || is_depth(*right)) continue;
    if (are_sides(*right, *left)) std::swap(left, right);
    const std::size_t merit = 1 + pair.agreement.pairs + (are_sides(*left, *right) ? 1U << 30U : 0);
    if (merit <= best) continue;
    best = merit;
    rig.left.topic = left->topic;
    rig.right.topic = right->topic;
  }
}

// True if the images may show the same pixels, see DepthAlignment.
bool may_be_aligned(const TopicSummary& camera, const TopicSummary& depth) {
  return !camera.image || !depth.image ||
         (different_size(*camera.image, *depth.image) +
          different_frame(*camera.image, *depth.image))
             .empty();
}

// Prefers a camera and depth that are aligned.
void propose_depth(const std::vector<TopicSummary>& topics, RigFile& rig) {
  for (const bool aligned : {true, false})
    for (const TopicSummary& depth : topics)
      for (const TopicSummary& camera : topics) {
        const bool is_camera = camera.is_image && !is_depth(camera) &&
                               (rig.left.topic.empty() || camera.topic == rig.left.topic);
        if (!rig.depth.topic.empty() || !is_depth(depth) || !is_camera) continue;
        if (aligned && !may_be_aligned(camera, depth)) continue;
        rig.left.topic = camera.topic;
        rig.depth.topic = depth.topic;
      }
}

// Among several topics, takes the one that shares the longest prefix with the topic of the left
// camera: "/Alpha/...".
void propose_imu(const std::vector<TopicSummary>& topics, RigFile& rig) {
  const auto likeness = [&rig](const std::string& topic) {
    const std::string& left = rig.left.topic;
    const auto end = std::ranges::mismatch(left, topic).in1;
    return std::ranges::count(left.begin(), end, '/');
  };
  for (const TopicSummary& topic : topics) {
    const bool is_imu = is_of_type({topic.topic, topic.type, topic.encoding, 0}, RosImu::kType);
    if (!is_imu || topic.stamps.empty()) continue;
    std::string& place = has_word(topic, "gyro")    ? rig.imu.gyro_topic
                         : has_word(topic, "accel") ? rig.imu.accel_topic
                                                    : rig.imu.topic;
    if (place.empty() || likeness(topic.topic) > likeness(place)) place = topic.topic;
  }
  if (!rig.imu.topic.empty()) rig.imu.gyro_topic = rig.imu.accel_topic = "";
}

// Topic on which a driver publishes the CameraInfo of these images; empty if there is none.
void propose_info(const std::vector<TopicSummary>& topics, RigFile::Camera& camera) {
  const std::string beside = camera_info_beside(camera.topic);
  const bool is_there = std::ranges::any_of(topics, [&beside](const TopicSummary& topic) {
    return topic.topic == beside && !topic.stamps.empty() &&
           is_of_type({topic.topic, topic.type, topic.encoding, 0}, RosCameraInfo::kType);
  });
  if (is_there && !camera.topic.empty()) camera.info_topic = beside;
}

}  // namespace

RigFile propose_rig(const std::vector<TopicSummary>& topics) {
  RigFile rig;
  propose_stereo(topics, rig);
  propose_depth(topics, rig);
  propose_imu(topics, rig);
  propose_info(topics, rig.left);
  propose_info(topics, rig.right);
  return rig;
}

std::string depth_problem(const std::vector<TopicSummary>& topics, const RigFile& rig) {
  if (rig.depth.topic.empty() || !rig.right.topic.empty()) return "";
  const TopicSummary &left = named(topics, rig.left.topic), &depth = named(topics, rig.depth.topic);
  if (may_be_aligned(left, depth)) return "";
  const std::string size = different_size(*left.image, *depth.image);
  return misaligned_text(left.topic, depth.topic,
                         size.empty() ? different_frame(*left.image, *depth.image) : size);
}

}  // namespace km
