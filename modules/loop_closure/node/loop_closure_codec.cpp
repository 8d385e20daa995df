#include "modules/loop_closure/node/loop_closure_codec.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "modules/loop_closure/packed_word_points.hpp"
#include "runtime/dds/codec.hpp"
#include "runtime/dds/wire_pose.hpp"

namespace km {
namespace {

constexpr float kBearingSteps = 32767.0F;
constexpr float kDepthSteps = 65535.0F;
constexpr float kMaxBearing = 100.0F;     // 89.4 degrees off the optical axis
constexpr float kMaxInverseDepth = 1e4F;  // [1/m]: 0.1 mm before the lens
constexpr double kMaxBaseline_m = 1e3;
constexpr double kMaxFocal_px = 1e6;
constexpr std::uint8_t kMaxOctave = 31;
constexpr std::uint32_t kMaxInliers = 1U << 20U;
constexpr float kMaxSimilarity = 1e6F;

bool in_range(float value, float max) {
  return value >= 0.0F && value <= max;
}  // false for NaN

// Quantisation steps, chosen so that the largest value uses the full range.
struct Steps {
  float bearing = 0.0F;
  float inverse_depth = 0.0F;
};

Steps steps_of(const KeyframeFeatures& features) {
  Steps largest;
  for (const Keypoint& point : features.keypoints) {
    largest.bearing = std::max(largest.bearing, point.bearing.cwiseAbs().maxCoeff());
    largest.inverse_depth = std::max(largest.inverse_depth, point.inverse_depth);
  }
  return {largest.bearing / kBearingSteps, largest.inverse_depth / kDepthSteps};
}

static_assert(sizeof(km_wire_Keypoint::descriptor) == kDescriptorBytes, "see idl/loop_closure.idl");

km_wire_Keypoint to_wire(const Keypoint& point, const BinaryDescriptor& descriptor,
                         const Steps& steps) {
  const auto bearing = [&](float value) {
    return static_cast<std::int16_t>(steps.bearing > 0.0F ? std::lround(value / steps.bearing)
                                                          : 0L);
  };
  km_wire_Keypoint wire{};
  wire.bearing[0] = bearing(point.bearing.x());
  wire.bearing[1] = bearing(point.bearing.y());
  // Rounding must not turn a known depth into 0, which means unknown.
  if (point.has_depth())
    wire.inverse_depth = static_cast<std::uint16_t>(
        std::max(1L, std::lround(point.inverse_depth / steps.inverse_depth)));
  wire.octave = point.octave;
  std::copy(descriptor.begin(), descriptor.end(), wire.descriptor);
  return wire;
}

Keypoint from_wire(const km_wire_Keypoint& wire, const Steps& steps) {
  Keypoint point;
  point.bearing = steps.bearing * Eigen::Vector2f(wire.bearing[0], wire.bearing[1]);
  point.inverse_depth = steps.inverse_depth * static_cast<float>(wire.inverse_depth);
  point.octave = wire.octave;
  return point;
}

using WireKeypoints = std::span<const km_wire_Keypoint>;

// Reason why the features of a reply cannot be used, or nullptr.
const char* refusal(const km_wire_KeyframeReply& wire, WireKeypoints keypoints) {
  if (!in_range(wire.bearing_step, kMaxBearing / kBearingSteps)) return "bearings out of range";
  if (!in_range(wire.inverse_depth_step, kMaxInverseDepth / kDepthSteps))
    return "depths out of range";
  if (!in_range(wire.focal_px, kMaxFocal_px)) return "focal length out of range";
  if (!in_range(wire.baseline_m, kMaxBaseline_m)) return "baseline out of range";
  if (!keypoints.empty() && !(wire.focal_px > 0.0F && wire.baseline_m > 0.0F))
    return "keypoints without focal length or baseline";
  for (const km_wire_Keypoint& point : keypoints)
    if (point.octave > kMaxOctave) return "octave out of range";
  return nullptr;
}

KeyframeFeatures features_of(const km_wire_KeyframeReply& wire, WireKeypoints keypoints,
                             const SE3& T_body_cam) {
  KeyframeFeatures features;
  features.T_body_cam = T_body_cam;
  features.focal_px = static_cast<double>(wire.focal_px);
  features.baseline_m = static_cast<double>(wire.baseline_m);
  features.keypoints.reserve(keypoints.size());
  features.descriptors.reserve(keypoints.size());
  const Steps steps{wire.bearing_step, wire.inverse_depth_step};
  for (const km_wire_Keypoint& point : keypoints) {
    features.keypoints.push_back(from_wire(point, steps));
    std::copy(std::begin(point.descriptor), std::end(point.descriptor),
              features.descriptors.emplace_back().begin());
  }
  return features;
}

}  // namespace

MessageKey Codec<KeyframeRequest>::key_of(const KeyframeRequest& request) {
  return message_key({request.number});
}

Codec<KeyframeRequest>::Encoded Codec<KeyframeRequest>::encode(const KeyframeRequest& request) {
  Encoded encoded;
  encoded.wire.request = request.number;
  encoded.wire.keyframe = to_wire(request.keyframe);
  encoded.wire.own = request.own;
  encoded.wire.part = static_cast<std::uint8_t>(request.part);
  return encoded;
}

Decoded<KeyframeRequest> Codec<KeyframeRequest>::decode(const Wire& wire, const TeamPeer& writer) {
  if (wire.part > static_cast<std::uint8_t>(KeyframePart::kWordPoints))
    return Decoded<KeyframeRequest>::refuse("an unknown part of a keyframe");
  return Decoded<KeyframeRequest>::accept({writer.robot, wire.request, from_wire(wire.keyframe),
                                           wire.own, static_cast<KeyframePart>(wire.part)});
}

MessageKey Codec<KeyframeWords>::key_of(const KeyframeWords& words) {
  return message_key({words.keyframe.index, words.number});
}

Codec<KeyframeWords>::Encoded Codec<KeyframeWords>::encode(const KeyframeWords& words) {
  Encoded encoded;
  encoded.wire.keyframe = to_wire(words.keyframe);
  encoded.wire.request = words.number;
  encoded.points = pack(words.words);
  borrow(encoded.wire.points, encoded.points);
  return encoded;
}

Decoded<KeyframeWords> Codec<KeyframeWords>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<KeyframeWords>;
  if (wire.keyframe.robot != writer.robot)
    return Result::refuse("a keyframe of another robot than the writer");
  const auto bytes = elements_of(wire.points, kMaxBytes);
  auto points = bytes ? unpack_word_points(*bytes) : std::nullopt;
  if (!points) return Result::refuse("points are missing, too many, or none of a camera");
  return Result::accept(
      {.number = wire.request, .keyframe = from_wire(wire.keyframe), .words = *std::move(points)});
}

MessageKey Codec<KeyframeReply>::key_of(const KeyframeReply& reply) {
  return message_key({reply.keyframe.odometry.id.index, reply.number});
}

Codec<KeyframeReply>::Encoded Codec<KeyframeReply>::encode(const KeyframeReply& reply) {
  Encoded encoded;
  Wire& wire = encoded.wire;
  const Keyframe& keyframe = reply.keyframe;
  const KeyframeFeatures& features = keyframe.features;
  wire.keyframe = to_wire(keyframe.odometry.id);
  wire.request = reply.number;
  wire.found = reply.found;
  wire.odometry = to_wire(keyframe.odometry);
  wire.stamp = keyframe.stamp;
  wire.T_body_cam = to_wire(features.T_body_cam);
  wire.focal_px = static_cast<float>(features.focal_px);
  wire.baseline_m = static_cast<float>(features.baseline_m);
  const Steps steps = steps_of(features);
  wire.bearing_step = steps.bearing;
  wire.inverse_depth_step = steps.inverse_depth;
  encoded.keypoints.reserve(features.keypoints.size());
  for (std::size_t i = 0; i < features.keypoints.size(); ++i)
    encoded.keypoints.push_back(to_wire(features.keypoints[i], features.descriptors[i], steps));
  borrow(wire.keypoints, encoded.keypoints);
  return encoded;
}

Decoded<KeyframeReply> Codec<KeyframeReply>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<KeyframeReply>;
  if (wire.keyframe.robot != writer.robot)
    return Result::refuse("a keyframe of another robot than the writer");
  KeyframeReply reply{.number = wire.request, .found = wire.found, .keyframe = {}};
  reply.keyframe.odometry.id = from_wire(wire.keyframe);
  if (!wire.found) return Result::accept(std::move(reply));

  const auto odometry = from_wire(wire.odometry);
  if (!odometry) return Result::refuse("odometry is not a pose with a covariance");
  if (odometry->id != reply.keyframe.odometry.id)
    return Result::refuse("odometry of another keyframe");
  const auto T_body_cam = from_wire(wire.T_body_cam);
  if (!T_body_cam) return Result::refuse("the camera's place is not a pose");
  const auto keypoints = elements_of(wire.keypoints, kMaxKeypoints);
  if (!keypoints) return Result::refuse("keypoints are missing or too many");
  if (const char* why = refusal(wire, *keypoints)) return Result::refuse(why);
  reply.keyframe.odometry = *odometry;
  reply.keyframe.stamp = wire.stamp;
  reply.keyframe.features = features_of(wire, *keypoints, *T_body_cam);
  return Result::accept(std::move(reply));
}

MessageKey Codec<Closure>::key_of(const Closure& closure) {
  const KeyframeId& from = closure.from.id;
  const KeyframeId& to = closure.to.id;
  return message_key({from.robot, from.index, to.robot, to.index});
}

Codec<Closure>::Encoded Codec<Closure>::encode(const Closure& closure) {
  Encoded encoded;
  Wire& wire = encoded.wire;
  wire.from = to_wire(closure.from);
  wire.to = to_wire(closure.to);
  wire.T_from_to = to_wire(closure.T_from_to);
  wire.covariance = to_wire(closure.covariance);
  wire.inliers = static_cast<std::uint32_t>(std::max(0, closure.inliers));
  wire.similarity = static_cast<float>(closure.similarity);
  return encoded;
}

Decoded<Closure> Codec<Closure>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<Closure>;
  if (wire.from.keyframe.robot != writer.robot)
    return Result::refuse("it starts from another robot than the writer");
  const auto from = from_wire(wire.from);
  const auto to = from_wire(wire.to);
  if (!from || !to) return Result::refuse("odometry is not a pose with a covariance");
  if (from->id == to->id) return Result::refuse("a closure from a keyframe to itself");
  const auto T_from_to = from_wire(wire.T_from_to);
  const auto covariance = from_wire(wire.covariance);
  if (!T_from_to || !covariance) return Result::refuse("it is not a pose with a covariance");
  // The pose graph inverts the covariance to weigh the closure.
  if (covariance->llt().info() != Eigen::Success) return Result::refuse("a singular covariance");
  if (wire.inliers > kMaxInliers) return Result::refuse("too many inliers");
  if (!in_range(wire.similarity, kMaxSimilarity)) return Result::refuse("similarity out of range");
  return Result::accept({.from = *from,
                         .to = *to,
                         .T_from_to = *T_from_to,
                         .covariance = *covariance,
                         .inliers = static_cast<int>(wire.inliers),
                         .similarity = static_cast<double>(wire.similarity)});
}

}  // namespace km
