#include "modules/loop_closure/node/loop_closure_codec.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "runtime/dds/wire_pose.hpp"

namespace km {
namespace {

constexpr std::uint32_t kMaxInliers = 1U << 20U;
constexpr float kMaxSimilarity = 1e6F;

bool in_range(float value, float max) {
  return value >= 0.0F && value <= max;
}  // false for NaN

}  // namespace

MessageKey Codec<KeyframeRequest>::key_of(const KeyframeRequest& request) {
  return message_key({request.number});
}

Codec<KeyframeRequest>::Encoded Codec<KeyframeRequest>::encode(const KeyframeRequest& request) {
  Encoded encoded;
  encoded.wire.request = request.number;
  encoded.wire.keyframe = to_wire(request.keyframe);
  encoded.wire.own = request.own;
  encoded.wire.network = request.network;
  encoded.wire.part = static_cast<std::uint8_t>(request.part);
  return encoded;
}

Decoded<KeyframeRequest> Codec<KeyframeRequest>::decode(const Wire& wire, const TeamPeer& writer) {
  if (wire.part > static_cast<std::uint8_t>(KeyframePart::kDescriptors))
    return Decoded<KeyframeRequest>::refuse("an unknown part of a keyframe");
  return Decoded<KeyframeRequest>::accept({writer.robot, wire.request, from_wire(wire.keyframe),
                                           wire.own, static_cast<KeyframePart>(wire.part),
                                           wire.network});
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
  wire.keyframe = to_wire(keyframe.odometry.id);
  wire.request = reply.number;
  wire.found = reply.found;
  wire.odometry = to_wire(keyframe.odometry);
  wire.stamp = keyframe.stamp;
  wire.network = keyframe.features.network;
  wire.T_body_cam = to_wire(keyframe.features.T_body_cam);
  encoded.features = pack(keyframe.features);
  borrow(wire.features, encoded.features);
  encoded.descriptors = pack(reply.descriptors);
  borrow(wire.descriptors, encoded.descriptors);
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
  const auto bytes = elements_of(wire.features, kMaxBytes);
  auto features = bytes ? unpack_features(*bytes) : std::nullopt;
  if (!features) return Result::refuse("keypoints are missing, too many, or none of a camera");
  const auto descriptor_bytes = elements_of(wire.descriptors, kMaxBytes);
  auto descriptors = descriptor_bytes ? unpack_descriptors(*descriptor_bytes) : std::nullopt;
  if (!descriptors) return Result::refuse("descriptors are missing, cut off, or too many");
  reply.descriptors = *std::move(descriptors);
  reply.keyframe.odometry = *odometry;
  reply.keyframe.stamp = wire.stamp;
  reply.keyframe.features = *std::move(features);
  reply.keyframe.features.T_body_cam = *T_body_cam;
  reply.keyframe.features.network = wire.network;
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
