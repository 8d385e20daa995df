#include "modules/core/geometry/lie.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

// 90 by 73.7 degrees, looking along the body's x axis as on a car.
Camera camera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 320.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  camera.T_body_cam.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return camera;
}

// A body at (x, y), rotated to the left by `yaw_deg`.
SE3 at(double x, double y, double yaw_deg = 0.0) {
  return make_pose(so3_exp({0.0, 0.0, kRadians * yaw_deg}), {x, y, 0.0});
}

// Pose of a camera to the right of another one.
SE3 sideways(double metres) {
  return make_pose(Eigen::Matrix3d::Identity(), {metres, 0.0, 0.0});
}

ClosureRecord closure(KeyframeId from, KeyframeId to, ClosureStage stage,
                      const std::optional<SE3>& T_from_to = std::nullopt) {
  return {{from, to}, stage, T_from_to};
}

// Robot 0 drives along x, robot 1 in parallel at a distance of 0.4 m. Both look ahead; the scene is
// 4 m away. There is a keyframe every 3 m, so that only keyframes side by side overlap enough.
// Robot 1's last keyframe is far away.
std::vector<TrueKeyframe> two_rows(std::uint32_t count) {
  std::vector<TrueKeyframe> keyframes;
  for (std::uint32_t i = 0; i < count; ++i) {
    keyframes.push_back({{0, i}, at(3.0 * i, 0.0), 4.0});
    keyframes.push_back({{1, i}, at(3.0 * i, i + 1 < count ? 0.4 : 500.0), 4.0});
  }
  return keyframes;
}

const SE3 kTruth = at(0.0, 0.4);  // pose of robot 1's keyframe i in robot 0's

TEST_CASE("The overlap of two views is the share of the image in both") {
  const double grid = 1.0 / 16;  // half a cell of the grid's eight columns
  CHECK(view_overlap(camera(), SE3::Identity(), 3.0) == 1.0);
  // The image is 2 * depth wide at any depth: after a sideways motion by a share of it, the rest is
  // in view.
  const double depth_m = GENERATE(1.0, 20.0);
  CHECK(view_overlap(camera(), sideways(0.5 * depth_m), depth_m) == Approx(0.75).margin(grid));
  CHECK(view_overlap(camera(), sideways(1.5 * depth_m), depth_m) == Approx(0.25).margin(grid));
  CHECK(view_overlap(camera(), sideways(2.5 * depth_m), depth_m) == 0.0);
  // No overlap in the opposite direction, and at twice the distance and more.
  CHECK(view_overlap(camera(), make_pose(so3_exp({0.0, std::numbers::pi, 0.0}), {0, 0, 0}),
                     depth_m) == 0.0);
  const SE3 behind = make_pose(Eigen::Matrix3d::Identity(), {0.0, 0.0, -1.2 * depth_m});
  CHECK(view_overlap(camera(), behind, depth_m) == 0.0);
}

TEST_CASE("Inserted errors are counted at each stage, by the given limits") {
  using enum ClosureStage;
  const auto keyframes = two_rows(6);
  const SE3 off_m = kTruth * at(0.6, 0.0);
  const SE3 off_deg = kTruth * at(0.0, 0.0, 6.0);
  const SE3 within = kTruth * at(0.3, 0.3, 4.0);
  const std::vector<ClosureRecord> closures = {
      closure({0, 0}, {1, 0}, kInlier, kTruth),
      closure({1, 0}, {0, 0}, kInlier, kTruth.inverse()),  // the same pair in the other direction
      closure({0, 1}, {1, 1}, kInlier, within),
      closure({0, 2}, {1, 2}, kInlier, off_m),
      closure({0, 3}, {1, 3}, kVerified, off_deg),
      closure({0, 4}, {1, 0}, kVerified, at(0.0, 0.0)),  // another place
      closure({0, 4}, {1, 4}, kCandidate),
      closure({0, 0}, {1, 3}, kReceived),
      closure({0, 0}, {7, 3}, kInlier, kTruth),  // a robot without truth
  };
  const ClosureScores scores = score_closures(keyframes, closures, camera());
  CHECK(scores.unjudged == 1);
  CHECK(scores.true_pairs == 5);
  CHECK(scores.true_frames == 10);
  CHECK(scores.candidates.judged == 8);
  CHECK(scores.candidates.correct == 6);
  CHECK(scores.candidates.pairs_found == 5);
  CHECK(scores.candidates.frames_found == 10);
  CHECK(scores.verified.judged == 6);
  CHECK(scores.verified.correct == 3);  // unknown covariances explain no error
  CHECK(scores.verified.beyond_limits == 3);
  CHECK(scores.verified.pairs_found == 2);
  CHECK(scores.inliers.judged == 4);
  CHECK(scores.inliers.correct == 3);
  CHECK(scores.inliers.precision() == Approx(0.75));
  CHECK(scores.pair_recall(scores.inliers) == Approx(0.4));
  CHECK(scores.frame_recall(scores.inliers) == Approx(0.4));
  CHECK(scores.inliers.translation_error_m.max == Approx(0.6));
  CHECK(scores.verified.rotation_error_deg.max == Approx(6.0));
  const auto correct = [&](const ClosureTruthOptions& options) {
    return score_closures(keyframes, closures, camera(), options).inliers.correct;
  };
  CHECK(correct({.max_translation_m = 0.4}) == 2);
  CHECK(correct({.max_rotation_deg = 3.9}) == 2);
  CHECK(correct({.max_translation_m = 0.61}) == 4);
}

TEST_CASE("A closure beyond the limits is false unless its covariance explains the error") {
  const auto keyframes = two_rows(2);
  ClosureRecord off = closure({0, 0}, {1, 0}, ClosureStage::kInlier, kTruth * at(0.0, 2.0, 8.0));
  const auto scores = [&] { return score_closures(keyframes, std::vector{off}, camera()).inliers; };
  off.sigma << 0.01, 0.01, 0.04, 0.1, 0.1, 2.0;  // 3.5 of the rotation, 20 of the translation
  CHECK(scores().correct == 0);
  off.sigma[4] = 1.0;  // 3.5 and 2
  CHECK(scores().correct == 1);
  CHECK(scores().beyond_limits == 1);
  CHECK(to_table(score_closures(keyframes, std::vector{off}, camera()))
            .find("inliers          1     1              1     100.0%") != std::string::npos);
  off.sigma[2] = 0.01;  // 14 of the rotation
  CHECK(scores().correct == 0);
  off.T_from_to = kTruth * at(0.4, 0.0);  // 4 sigma, but within the limits
  CHECK(scores().correct == 1);
  CHECK(scores().beyond_limits == 0);
}

TEST_CASE("Places scale with the depth of the scene") {
  // Side by side 0.4 m apart; the second robot's last keyframe is far away
  auto keyframes = two_rows(2);
  const auto pairs = [&](double depth_m) {
    for (TrueKeyframe& keyframe : keyframes) keyframe.scene_depth_m = depth_m;
    return score_closures(keyframes, {}, camera()).true_pairs;
  };
  CHECK(pairs(0.2) == 0);   // 0.4 m is a whole view at 0.2 m
  CHECK(pairs(2.0) == 1);   // overlaps by more than half a view
  CHECK(pairs(40.0) == 2);  // 3 m ahead is still the same place
  CHECK(pairs(0.0) == 1);   // unknown: the default of 5 m
}

TEST_CASE("Closures within a robot count for precision and not for recall") {
  std::vector<TrueKeyframe> keyframes = {{{0, 0}, at(0, 0), 4.0}, {{0, 9}, at(0.1, 0), 4.0}};
  const ClosureScores scores = score_closures(
      keyframes, std::vector{closure({0, 0}, {0, 9}, ClosureStage::kInlier, at(0.1, 0))}, camera());
  CHECK(scores.inliers.precision() == 1.0);
  CHECK(scores.true_pairs == 0);
  CHECK(std::isnan(scores.pair_recall(scores.inliers)));
  CHECK(std::isnan(scores.frame_recall(scores.inliers)));
  CHECK(std::isnan(score_closures(keyframes, {}, camera()).inliers.precision()));
}

TEST_CASE("True pairs are counted by the angle between the viewing directions") {
  using enum ClosureStage;
  // All look at the point 4 m in front of the first one: beside it, from the side, and from the
  // other side.
  const SE3 side = at(4.0, -4.0, 95.0), opposite = at(8.0, 0.0, 180.0);
  const std::vector<TrueKeyframe> keyframes = {{{0, 0}, at(0.0, 0.0), 4.0},
                                               {{1, 0}, at(0.0, 0.0, 10.0), 4.0},
                                               {{1, 1}, side, 4.0},
                                               {{1, 2}, opposite, 4.0}};
  ClosureTruthOptions options{.min_overlap = 0.1};
  const std::vector<ClosureRecord> closures = {
      closure({0, 0}, {1, 0}, kInlier, at(0.0, 0.0, 10.0)),
      closure({0, 0}, {1, 1}, kVerified, side),  // true, but not kept
      closure({0, 0}, {1, 2}, kInlier, opposite)};
  const ClosureScores scores = score_closures(keyframes, closures, camera(), options);
  const auto& bins = scores.by_angle;
  CHECK(bins[0].true_pairs == 1);
  CHECK(bins[0].pairs_found == 1);
  CHECK(bins[3].true_pairs == 1);
  CHECK(bins[3].pairs_found == 0);
  CHECK(bins[5].true_pairs == 1);
  CHECK(bins[5].pairs_found == 1);
  std::size_t sum = 0;
  for (const AngleScore& bin : bins) sum += bin.true_pairs;
  CHECK(sum == scores.true_pairs);
}

TEST_CASE("Invalid closures and options are refused") {
  const auto keyframes = two_rows(2);
  const std::vector<ClosureRecord> none = {
      closure({0, 0}, {1, 0}, ClosureStage::kVerified, std::nullopt)};
  CHECK_THROWS_WITH(score_closures(keyframes, none, camera()),
                    Contains("closure 0:0 - 1:0 is verified, but has no pose"));
  const std::vector<TrueKeyframe> twice = {keyframes[0], keyframes[0]};
  CHECK_THROWS_WITH(score_closures(twice, {}, camera()), Contains("keyframe 0:0 is given twice"));
  CHECK_THROWS_AS(score_closures(keyframes, {}, camera(), {.min_overlap = 1.5}), ConfigError);
}

const std::string kHeader =
    "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,"
    "tx,ty,tz,qx,qy,qz,qw,sigma_rx,sigma_ry,sigma_rz,sigma_tx,sigma_ty,sigma_tz,reason\n";

TEST_CASE("Errors in closure files are reported with their line") {
  const TemporaryFolder folder;
  const auto [row, problem] = GENERATE(table<std::string, std::string>(
      {{"1,2,3", "c.csv line 2: 3 fields, expected 21"},
       {"1,2,3,4,0.5,married,0,0,,,,,,,,,,,,,,", "married is no stage of a closure"},
       {"1,2,3,4,0.5,verified,0,0,,,,,,,,,,,,,,", "a verified closure without a pose"},
       {"70000,2,3,4,0.5,candidate,0,0,,,,,,,,,,,,,,", "70000 is not a number from 0 to 65535"},
       {"1,2,3,4,0.5,inlier,0,0,1,2,x,0,0,0,1,,,,,,,", "x is not a finite number"},
       {"1,2,3,4,0.5,inlier,0,0,1,2,3,0,0,0,2,,,,,,,", "the quaternion's norm is 2"},
       {"1,2,3,4,0.5,inlier,0,0,1,2,3,0,0,0,1,1,1,1,1,,1,", " is not a finite number"}}));
  CHECK_THROWS_WITH(read_closures(folder.write("c.csv", kHeader + row + '\n')), Contains(problem));
  CHECK_THROWS_WITH(read_keyframes(folder.path() / "none.csv"), EndsWith("no such file"));
  CHECK(read_closures(folder.write("empty.csv", kHeader)).empty());
}

}  // namespace
}  // namespace km
