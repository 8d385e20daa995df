#include "modules/loop_closure/node/loop_closure_codec.hpp"

#include <set>

#include "runtime/dds/envelope.hpp"
#include "test/support/corrupted_message.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kOwner = 40000;

KeyframeReply random_reply(std::mt19937& rng, int points) {
  KeyframeReply reply{.number = 12, .found = true, .keyframe = {}};
  reply.keyframe.odometry = {{kOwner, 7}, random_pose(rng), random_covariance(rng, 0.1)};
  reply.keyframe.stamp = 1403636584763555584;
  KeyframeFeatures& features = reply.keyframe.features;
  features.T_body_cam = random_pose(rng, 0.1);
  features.focal_px = 458.654;
  features.baseline_m = 0.11;
  std::uniform_real_distribution<float> bearing(-0.9F, 0.9F);
  std::uniform_real_distribution<float> depth(0.4F, 60.0F);
  for (int i = 0; i < points; ++i) {
    Keypoint point;
    point.bearing.x() = bearing(rng);
    point.bearing.y() = bearing(rng);
    point.inverse_depth = i % 4 == 0 ? 0.0F : 1.0F / depth(rng);
    point.octave = static_cast<std::uint8_t>(i % 8);
    features.keypoints.push_back(point);
    MatchedDescriptor& descriptor = features.matched.emplace_back();
    for (auto& byte : descriptor) byte = static_cast<std::uint8_t>(rng());
  }
  features.network = 40123;
  return reply;
}

TEST_CASE("A keyframe, and that one was not found, survive the wire") {
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  KeyframeReply sent = random_reply(rng, 1000);
  sent.descriptors = {sent.keyframe.features.matched[5]};
  const auto encoded = encoded_by(kOwner, sent);
  const auto result = decoded(encoded);
  REQUIRE(result.value.has_value());
  const Keyframe &a = sent.keyframe, &b = result.value->keyframe;
  CHECK(result.value->number == 12);
  CHECK(b.stamp == a.stamp);
  CHECK(b.odometry.T_odom_kf.isApprox(a.odometry.T_odom_kf, 1e-6));
  CHECK(b.odometry.covariance.isApprox(a.odometry.covariance, 1e-6));
  CHECK((b.features.T_body_cam.matrix() - a.features.T_body_cam.matrix()).norm() < 1e-12);
  CHECK(pack(b.features) == pack(a.features));
  CHECK(b.features.network == a.features.network);
  CHECK(result.value->descriptors == sent.descriptors);

  KeyframeReply absent{.number = 3, .found = false, .keyframe = {}};
  absent.keyframe.odometry.id = {kOwner, 99};
  const auto none = decoded(encoded_by(kOwner, absent));
  REQUIRE(none.value.has_value());
  CHECK_FALSE(none.value->found);
  CHECK(none.value->keyframe.odometry.id == KeyframeId{kOwner, 99});
}

TEST_CASE("Hostile replies are refused with a reason") {
  std::mt19937 rng(7);
  KeyframeReply reply = random_reply(rng, 20);
  reply.descriptors.resize(3);
  const char* const no_pose = "odometry is not a pose with a covariance";
  const char* const no_descriptors = "descriptors are missing, cut off, or too many";
  const char* const no_features = "keypoints are missing, too many, or none of a camera";
  check_refusals<KeyframeReply>(
      [&] { return encoded_by(kOwner, reply); },
      {{"another robot's keyframe", "a keyframe of another robot than the writer",
        [](auto& m) { m.writer.robot = 3; }},
       {"odometry of another keyframe", "odometry of another keyframe",
        [](auto& m) { m.wire.odometry.keyframe.index = 8; }},
       {"a quaternion that is none", no_pose, [](auto& m) { m.wire.odometry.q[0] = 4.0F; }},
       {"a variance that is not a number", no_pose,
        [](auto& m) { m.wire.odometry.root[0] = std::nanf(""); }},
       {"a descriptor that is cut off", no_descriptors,
        [](auto& m) { --m.wire.descriptors._length; }},
       {"descriptors without a buffer", no_descriptors,
        [](auto& m) { m.wire.descriptors._buffer = nullptr; }},
       {"a position that is not a number", "the camera's place is not a pose",
        [](auto& m) { m.wire.T_body_cam.t[1] = std::nan(""); }},
       {"keypoints without a buffer", no_features,
        [](auto& m) { m.wire.features._buffer = nullptr; }},
       {"keypoints that are cut off", no_features, [](auto& m) { --m.wire.features._length; }},
       {"a length beyond every message", no_features,
        [](auto& m) { m.wire.features._length = 1U << 30U; }},
       {"a negative focal length", no_features, [](auto& m) { m.features[0] |= 0x80; }}});
}

TEST_CASE("A closure survives the wire exactly") {
  std::mt19937 rng(8);
  const Closure sent{.from = {{kOwner, 1}, random_pose(rng), random_covariance(rng, 0.1)},
                     .to = {{9, 5}, random_pose(rng), random_covariance(rng, 0.2)},
                     .T_from_to = random_pose(rng),
                     .covariance = random_covariance(rng, 0.01),
                     .inliers = 77,
                     .similarity = 0.75};
  const auto encoded = encoded_by(kOwner, sent);
  const auto result = decoded(encoded);
  REQUIRE(result.value.has_value());
  CHECK(result.value->id() == sent.id());
  CHECK(result.value->covariance == sent.covariance);
  CHECK((result.value->T_from_to.matrix() - sent.T_from_to.matrix()).norm() < 1e-12);
  CHECK(result.value->inliers == 77);
  CHECK(result.value->similarity == 0.75);
}

TEST_CASE("A closure that ends within an array is not read") {
  Closure closure;
  closure.T_from_to = SE3::Identity();
  const auto encoded = encoded_by(kOwner, closure);
  auto bytes = serialize(Codec<Closure>::descriptor(), &encoded.wire);
  std::set<std::size_t> read;
  while (bytes.size() > 4) {
    bytes.pop_back();
    const std::size_t length = bytes.size() - 4;
    bytes[0] = static_cast<std::uint8_t>(length);
    bytes[1] = static_cast<std::uint8_t>(length >> 8U);
    if (WireSample(Codec<Closure>::descriptor()).read(bytes)) read.insert(bytes.size());
  }
  CHECK(read == std::set<std::size_t>{4, 136, 268, 324, 492, 496});  // ends of fields
}

TEST_CASE("Hostile closures and requests are refused with a reason") {
  std::mt19937 rng(9);
  const Closure closure{.from = {{kOwner, 1}, random_pose(rng), Matrix6::Identity()},
                        .to = {{9, 5}, random_pose(rng), Matrix6::Identity()}};
  check_refusals<Closure>(
      [&] { return encoded_by(kOwner, closure); },
      {{"written by another robot", "it starts from another robot than the writer",
        [](auto& m) { m.writer.robot = 9; }},
       {"from a keyframe to itself", "a closure from a keyframe to itself",
        [](auto& m) { m.wire.to = m.wire.from; }},
       {"a similarity that is not a number", "similarity out of range",
        [](auto& m) { m.wire.similarity = std::nanf(""); }},
       {"absurdly many inliers", "too many inliers", [](auto& m) { m.wire.inliers = ~0U; }}});

  using enum KeyframePart;
  const KeyframePart part = GENERATE(kFeatures, kWordPoints, kDescriptors);
  const auto request = encoded_by<KeyframeRequest>(kOwner, {kOwner, 1, {9, 5}, 17, part, 40123});
  check_refusals<KeyframeRequest>(
      [&] {
        return encoded_by<KeyframeRequest>(kOwner, {kOwner, 1, {9, 5}, 17, part, 40123});
      },
      {{"of a part that is none", "an unknown part of a keyframe",
        [](auto& m) { m.wire.part = 3; }}});
  const auto result = decoded(request).value;
  REQUIRE(result);
  CHECK(result->keyframe == KeyframeId{9, 5});
  CHECK(result->own == 17);
  CHECK(result->requester == kOwner);
  CHECK(result->part == part);
  CHECK(result->network == 40123);
}

TEST_CASE("Points of words survive the wire, and hostile ones are refused") {
  const Keypoint point{.bearing = {0.5F, -0.25F}, .inverse_depth = 0.5F, .octave = 2};
  const KeyframeWords sent{
      .number = 12, .keyframe = {kOwner, 7}, .words = {450.0, 0.1, {{point, 3}, {point, 4000}}}};
  const auto encode = [&] { return encoded_by(kOwner, sent); };
  const auto encoded = encode();
  const auto received = decoded(encoded).value;
  REQUIRE(received);
  CHECK(received->number == 12);
  CHECK(received->keyframe == sent.keyframe);
  REQUIRE(received->words.points.size() == 2);
  CHECK(received->words.points[1].word == 4000);
  CHECK(received->words.points[1].keypoint.bearing.isApprox(point.bearing, 1e-3F));
  constexpr const char* kNone = "points are missing, too many, or none of a camera";
  check_refusals<KeyframeWords>(
      encode, {{"written by another robot", "a keyframe of another robot than the writer",
                [](auto& m) { m.writer.robot = 9; }},
               {"without a buffer", kNone, [](auto& m) { m.wire.points._buffer = nullptr; }},
               {"cut off", kNone, [](auto& m) { --m.wire.points._length; }},
               {"without a focal length", kNone, [](auto& m) { m.points[0] = 0x80; }}});
}

}  // namespace
}  // namespace km
