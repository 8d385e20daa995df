#include <catch2/catch.hpp>
#include <limits>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "modules/view/view_update.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Rounding of float32 at 10 m: half a unit in the last place, and as much from the quaternion.
constexpr double kPoseTolerance = 2e-6;

RobotSample some_state() {
  return {.name = "alpha",
          .phase = "running",
          .dataset_time_s = 12.5,
          .keyframes = 300,
          .skipped_frames = 2,
          .anchor = 3,
          .tentative = true,
          .round = 70000,
          .cost = 1234.5,
          .gradient_norm = 1e-3,
          .cpu_s = 7.25,
          .resident_MB = 180.0,
          .links = {{3, 0.25F}, {65535, 12.0F}},
          .sent_bytes = {{"pgo", 123456.0}, {"other", 1.0}},
          .loads = {{"vio", 0.75}}};
}

ViewKeyframes some_keyframes(std::size_t count) {
  std::mt19937 rng(7);
  ViewKeyframes keyframes{.optimized = true, .anchor = 2, .first = 1000, .T_world_kf = {}};
  for (std::size_t k = 0; k < count; ++k) keyframes.T_world_kf.push_back(random_pose(rng));
  return keyframes;
}

ViewClosures some_closures() {
  return {{{{{1, 5}, {2, 900}}, ClosureStatus::kCandidate, 0, 0, ""},
           {{{1, 5}, {2, 901}}, ClosureStatus::kRejected, 65535, 12, "too few inliers"},
           {{{1, 70000}, {1, 70001}}, ClosureStatus::kKept, 120, 80, ""}}};
}

MeshChunk some_chunk() {
  return {.key = {0, {1, -2, 3}, 4},
          .anchor = 3,
          .step_m = 0.002F,
          .origin = {-(1 << 30), 7, 1000},
          .offsets = {{0, 0, 0}, {9, 0, 0}, {0, 65535, 0}, {0, 0, 9}},
          .labels = {1, 2, 3, 4},
          .faces = {{0, 1, 2}, {0, 2, 3}}};
}

ViewImage some_image() {
  return {.stamp = -5, .jpeg = {0xFF, 0xD8, 0, 1, 2}, .features = {{0.5F, 479.5F}, {3.0F, 4.0F}}};
}

ViewObjects some_objects() {
  return {.anchor = 3,
          .objects = {{7, {1.0F, -2.0F, 0.5F}, 0.25F, {2.0F, 1.0F, 1.5F}, {0, 300}},
                      {9, {4.0F, 0.0F, 0.0F}, -1.5F, {0.5F, 0.25F, 0.0F}, {}}},
          .left_out = 12};
}

ViewRaster some_raster() {
  return {.kind = RasterKind::kOccupancy,
          .anchor = 3,
          .resolution_m = 0.25F,
          .origin = {-1.0F, 2.0F, 0.5F},
          .width = 3,
          .height = 2,
          .runs = {3, ViewRaster::kUnknown, 2, ViewRaster::kFree, 1, ViewRaster::kOccupied}};
}

std::vector<ViewContent> all_kinds() {
  std::mt19937 rng(3);
  return {some_state(),
          ViewPose{1'400'000'000'123'456'789, random_pose(rng)},
          some_keyframes(5),
          some_closures(),
          some_chunk(),
          some_image(),
          ViewKeyframes{.T_world_kf = {random_pose(rng)}, .stamps = {7}},
          some_objects(),
          some_raster()};
}

std::vector<Bytes> samples() {
  std::vector<Bytes> all;
  for (const ViewContent& content : all_kinds()) all.push_back(encode_view(content));
  return all;
}

template <typename T>
T round_trip(const T& content) {
  const auto decoded = decode_view(encode_view(content));
  REQUIRE(decoded);
  REQUIRE(std::holds_alternative<T>(*decoded));
  return std::get<T>(*decoded);
}

bool is_understood(const ViewContent& content) {
  return decode_view(encode_view(content)).has_value();
}

TEST_CASE("A state is unchanged by encoding and decoding", "[view]") {
  const RobotSample sent = some_state();
  const RobotSample got = round_trip(sent);
  CHECK(got.name == sent.name);
  CHECK(got.phase == sent.phase);
  CHECK(got.dataset_time_s == sent.dataset_time_s);
  CHECK(got.keyframes == sent.keyframes);
  CHECK(got.skipped_frames == sent.skipped_frames);
  CHECK(got.anchor == sent.anchor);
  CHECK(got.tentative);
  CHECK(got.round == sent.round);
  CHECK(got.cost == sent.cost);
  CHECK(got.gradient_norm == sent.gradient_norm);
  CHECK(got.cpu_s == sent.cpu_s);
  CHECK(got.resident_MB == sent.resident_MB);
  REQUIRE(got.links.size() == 2);
  CHECK(got.links[1].robot == 65535);
  CHECK(got.links[1].silent_s == 12.0F);
  REQUIRE(got.sent_bytes.size() == 2);
  CHECK(got.sent_bytes[0].name == "pgo");
  CHECK(got.sent_bytes[0].value == 123456.0);
  REQUIRE(got.loads.size() == 1);
  CHECK(got.loads[0].name == "vio");
}

TEST_CASE("Poses are encoded as float32", "[view]") {
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  const ViewPose sent{123, random_pose(rng)};
  const ViewPose got = round_trip(sent);
  CHECK(got.stamp == sent.stamp);
  CHECK((got.T_odom_body.matrix() - sent.T_odom_body.matrix()).norm() < kPoseTolerance);

  const ViewKeyframes keyframes = round_trip(some_keyframes(20));
  CHECK(keyframes.optimized);
  CHECK(keyframes.anchor == 2);
  CHECK(keyframes.first == 1000);
  REQUIRE(keyframes.T_world_kf.size() == 20);
  for (std::size_t k = 0; k < 20; ++k)
    CHECK((keyframes.T_world_kf[k].matrix() - some_keyframes(20).T_world_kf[k].matrix()).norm() <
          kPoseTolerance);
  CHECK(keyframes.stamps.empty());
  ViewKeyframes odometry = some_keyframes(2);
  odometry.optimized = false;
  odometry.stamps = {1'400'000'000'123'456'789, -5};
  CHECK_FALSE(round_trip(odometry).optimized);
  CHECK(round_trip(odometry).stamps == odometry.stamps);
}

TEST_CASE("Closures are unchanged by encoding and decoding", "[view]") {
  const auto sent = some_closures().closures;
  const auto got = round_trip(some_closures()).closures;
  REQUIRE(got.size() == sent.size());
  for (std::size_t k = 0; k < sent.size(); ++k) {
    CAPTURE(k);
    CHECK(got[k].id == sent[k].id);
    CHECK(got[k].verdict == sent[k].verdict);
    CHECK(got[k].matches == sent[k].matches);
    CHECK(got[k].inliers == sent[k].inliers);
    CHECK(got[k].reason == sent[k].reason);
  }
}

TEST_CASE("Mesh chunks and images are unchanged by encoding and decoding", "[view]") {
  CHECK(round_trip(some_chunk()) == some_chunk());
  const MeshChunk gone{.key = some_chunk().key};
  CHECK(round_trip(gone) == gone);
  const ViewImage got = round_trip(some_image());
  CHECK(got.stamp == some_image().stamp);
  CHECK(got.jpeg == some_image().jpeg);
  CHECK(got.features == some_image().features);
}

TEST_CASE("Objects and rasters are unchanged by encoding and decoding", "[view]") {
  const ViewObjects objects = round_trip(some_objects());
  CHECK(objects.anchor == 3);
  CHECK(objects.left_out == 12);
  REQUIRE(objects.objects.size() == 2);
  const ViewObject& first = objects.objects[0];
  CHECK(first.label == 7);
  CHECK(first.center == some_objects().objects[0].center);
  CHECK(first.yaw_rad == 0.25F);
  CHECK(first.size_m == some_objects().objects[0].size_m);
  CHECK(first.robots == std::vector<RobotId>{0, 300});

  const ViewRaster raster = round_trip(some_raster());
  CHECK(raster.kind == RasterKind::kOccupancy);
  CHECK(raster.anchor == 3);
  CHECK(raster.resolution_m == 0.25F);
  CHECK(raster.origin == some_raster().origin);
  CHECK(raster.width == 3);
  CHECK(raster.height == 2);
  CHECK(raster.runs == some_raster().runs);
}

TEST_CASE("Texts are encoded in printable ASCII", "[view]") {
  RobotSample state;
  state.name = "a\nb\xC3\xA9";
  CHECK(round_trip(state).name == "a?b??");
}

TEST_CASE("Truncated and extended updates are refused", "[view]") {
  for (const Bytes& sample : samples()) {
    CAPTURE(int{sample[0]});
    REQUIRE(decode_view(sample));
    for (std::size_t size = 0; size < sample.size(); ++size)
      CHECK_FALSE(decode_view(std::span(sample).first(size)));
    Bytes longer = sample;
    longer.push_back(0);
    CHECK_FALSE(decode_view(longer));
  }
  CHECK_FALSE(decode_view(Bytes{8}));
  CHECK_FALSE(decode_view(Bytes{255, 0, 0}));
}

TEST_CASE("Updates with impossible numbers are refused", "[view]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  RobotSample state;
  SECTION("a cost") {
    state.cost = nan;
    CHECK_FALSE(is_understood(state));
  }
  SECTION("a load") {
    state.loads = {{"vio", nan}};
    CHECK_FALSE(is_understood(state));
  }
  SECTION("a silence") {
    state.links = {{1, infinity}};
    CHECK_FALSE(is_understood(state));
  }
  SECTION("a position") {
    ViewPose pose;
    pose.T_odom_body.translation().y() = nan;
    CHECK_FALSE(is_understood(pose));
    pose.T_odom_body.translation().y() = 2e7;
    CHECK_FALSE(is_understood(pose));
  }
  SECTION("a rotation") {
    ViewKeyframes keyframes = some_keyframes(2);
    keyframes.T_world_kf[1].linear() *= 1.1;  // A matrix that is no rotation.
    CHECK_FALSE(is_understood(keyframes));
  }
  SECTION("a feature") {
    ViewImage image = some_image();
    image.features[1][0] = infinity;
    CHECK_FALSE(is_understood(image));
  }
  SECTION("a closure with its ends exchanged") {
    ViewClosures closures = some_closures();
    std::swap(closures.closures[0].id.from, closures.closures[0].id.to);
    CHECK_FALSE(is_understood(closures));
  }
  SECTION("a verdict") {
    ViewClosures closures = some_closures();
    closures.closures[0].verdict = static_cast<ClosureStatus>(4);
    CHECK_FALSE(is_understood(closures));
  }
  SECTION("a box of negative size") {
    ViewObjects objects = some_objects();
    objects.objects[1].size_m.y() = -1.0F;
    CHECK_FALSE(is_understood(objects));
  }
  SECTION("a raster whose runs do not have the number of its cells") {
    ViewRaster raster = some_raster();
    raster.runs[0] = GENERATE(std::uint8_t{0}, std::uint8_t{2}, std::uint8_t{255});
    CHECK_FALSE(is_understood(raster));
  }
  SECTION("a raster with other values") {
    ViewRaster raster = some_raster();
    raster.runs[1] = 2;
    CHECK_FALSE(is_understood(raster));
    raster.kind = RasterKind::kDistances;
    CHECK(is_understood(raster));
  }
  SECTION("a raster that is too large") {
    ViewRaster raster = some_raster();
    raster.width = raster.height = ViewRaster::kMaxSide;
    CHECK_FALSE(is_understood(raster));
  }
  SECTION("a face outside") {
    MeshChunk chunk = some_chunk();
    chunk.faces[0][2] = 4;
    CHECK_FALSE(is_understood(chunk));
  }
}

TEST_CASE("The size of an update is bounded", "[view]") {
  CHECK(is_understood(some_keyframes(2000)));
  CHECK_THROWS_AS(encode_view(some_keyframes(2200)), std::length_error);
  ViewImage image;
  image.jpeg.resize(kMaxViewBytes - 20);
  CHECK(is_understood(image));
  image.jpeg.resize(kMaxViewBytes);
  CHECK_THROWS_AS(encode_view(image), std::length_error);
  Bytes bytes = encode_view(ViewKeyframes{});
  bytes.back() = 0x7F;  // More poses than follow.
  CHECK_FALSE(decode_view(bytes));
}

// Each accepted update equals the result of encoding it again, so it is safe to show.
TEST_CASE("Corrupted updates are refused or decoded consistently", "[view]") {
  const std::vector<Bytes> good = samples();
  InputCorrupter corrupter(GENERATE(1U, 2U));
  int accepted = 0;
  constexpr int kCount = 20'000;
  for (int k = 0; k < kCount; ++k) {
    const auto content = decode_view(corrupter(good));
    if (!content) continue;
    ++accepted;
    REQUIRE(is_understood(*content));
  }
  CHECK(accepted > 0);
  CHECK(accepted < kCount / 2);
}

}  // namespace
}  // namespace km
