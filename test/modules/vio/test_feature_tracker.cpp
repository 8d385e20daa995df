#include "modules/core/geometry/lie.hpp"
#include "modules/core/quantile.hpp"
#include "modules/vio/feature_detector.hpp"
#include "modules/vio/feature_tracker.hpp"
#include "test/support/test.hpp"
#include "textured_plane.hpp"

namespace km {
namespace {

constexpr Stamp kFrameNs = 50'000'000;

TrackerConfig small_image_config() {
  TrackerConfig config{.max_features = 80, .min_distance_px = 14};
  return config;
}

const TrackedFeature* find(const TrackedFrame& frame, std::uint64_t id) {
  for (const TrackedFeature& feature : frame.features) {
    if (feature.id == id) return &feature;
  }
  return nullptr;
}

SE3 camera_pose(int frame, const Vector6& twist_per_frame) {
  return se3_exp(static_cast<double>(frame) * twist_per_frame);
}

Vector6 twist(double rx, double ry, double rz, double x, double y, double z) {
  Vector6 xi;
  xi << rx, ry, rz, x, y, z;
  return xi;
}

std::ptrdiff_t located(const TrackedFrame& frame) {
  return std::count_if(frame.features.begin(), frame.features.end(),
                       [](const TrackedFeature& f) { return f.right.has_value(); });
}

// Pose of a camera that moves 22 mm sideways per image.
SE3 sideways(int frame) {
  return camera_pose(frame, twist(0, 0, 0, 0.02, 0.01, 0));
}

void require_ascending(const TrackedFrame& frame) {
  const bool ascending = std::adjacent_find(frame.features.begin(), frame.features.end(),
                                            [](const TrackedFeature& a, const TrackedFeature& b) {
                                              return a.id >= b.id;
                                            }) == frame.features.end();
  REQUIRE(ascending);
}

// Errors of eight images of a moving camera: of features within 50 degrees of the axis and beyond,
// and of right points.
struct TrackErrors {
  std::vector<double> px, wide_px, right_px;
};

TrackErrors errors_of_tracking(const StereoRig& rig, const TexturedPlane& plane,
                               const Vector6& motion, bool gyro) {
  const auto& [left, right] = rig.cameras;
  FeatureTracker tracker(rig, small_image_config());
  std::map<std::uint64_t, Eigen::Vector3d> landmarks;  // First position of each feature.
  TrackErrors errors;
  for (int i = 0; i < 8; ++i) {
    const SE3 T_world_body = camera_pose(i, motion);
    const Eigen::Matrix3d R = gyro ? so3_exp(motion.head<3>()) : Eigen::Matrix3d::Identity();
    const TrackedFrame frame = tracker.track(plane.render(rig, T_world_body, i * kFrameNs), R);
    require_ascending(frame);
    REQUIRE(frame.stamp == i * kFrameNs);
    for (const TrackedFeature& feature : frame.features) {
      const Eigen::Vector3d seen = plane.meet(T_world_body, feature.left);
      const Eigen::Vector3d by_right = T_world_body.inverse() * seen - Eigen::Vector3d(0.11, 0, 0);
      if (feature.right)
        errors.right_px.push_back(
            (right.project(*feature.right).value() - right.project_ray(by_right).value()).norm());
      const auto [landmark, is_new] = landmarks.try_emplace(feature.id, seen);
      CHECK(is_new == (feature.length == 1));
      if (is_new) continue;
      const auto expected = left.project_ray(T_world_body.inverse() * landmark->second);
      REQUIRE(expected.has_value());
      const bool wide = feature.left.norm() > std::tan(50.0 * M_PI / 180.0);
      (wide ? errors.wide_px : errors.px)
          .push_back((*expected - left.project(feature.left).value()).norm());
    }
  }
  return errors;
}

TEST_CASE("Features of a moving camera stay on their landmarks to a tenth of a pixel") {
  const Vector6 motion = GENERATE(twist(0, 0, 0, 0.02, 0.01, 0),     // sideways, 3 px
                                  twist(0.01, 0.02, 0.03, 0, 0, 0),  // turning only
                                  twist(0.01, -0.02, 0.01, 0.01, 0, 0.03));
  const bool gyro = GENERATE(true, false);
  CAPTURE(motion.transpose(), gyro);
  const TrackErrors errors = errors_of_tracking(test_rig(), TexturedPlane{}, motion, gyro);
  // Up to seven steps of drift on 8-bit images; a wrong pixel convention would show as 0.5 px.
  REQUIRE(errors.px.size() > 6 * 50);
  CHECK(quantile(errors.px, 0.5) < 0.05);
  CHECK(quantile(errors.px, 0.95) < 0.2);
}

TEST_CASE("Through a fisheye lens features stay on their landmarks, and pairs have depth") {
  const TexturedPlane plane{2.0, 0.25, 1};  // cells of 19 px in the middle, 3 px at 65 degrees
  const TrackErrors errors =
      errors_of_tracking(fisheye_rig(), plane, twist(0.01, -0.02, 0.01, 0.01, 0, 0.03), true);
  REQUIRE(errors.px.size() > 100);
  CHECK(quantile(errors.px, 0.5) < 0.05);
  CHECK(quantile(errors.px, 0.95) < 0.2);
  REQUIRE(errors.wide_px.size() > 200);  // the texture is too fine for the pixels there
  CHECK(quantile(errors.wide_px, 0.5) < 0.1);
  CHECK(quantile(errors.wide_px, 0.95) < 1.0);
  REQUIRE(errors.right_px.size() > 4 * 50);
  CHECK(quantile(errors.right_px, 0.5) < 0.05);
  CHECK(quantile(errors.right_px, 0.95) < 0.2);
}

TEST_CASE("Stereo matches of a plane have its depth") {
  // 63 px of disparity (126 in an image of twice the size), 13 px, 2.5 px.
  const double depth_m = GENERATE(0.4, 2.0, 10.0);
  CAPTURE(depth_m);
  const StereoRig rig = test_rig();
  const TexturedPlane plane{depth_m, 0.03 * depth_m, 3};
  FeatureTracker tracker(rig, small_image_config());
  const TrackedFrame frame =
      tracker.track(plane.render(rig, SE3::Identity(), 0), Eigen::Matrix3d::Identity());

  const double disparity_px = rig.cameras[0].fx * rig.baseline_m() / depth_m;
  std::vector<double> errors_px;
  int visible = 0;  // Features that the right camera can see.
  for (const TrackedFeature& feature : frame.features) {
    const Eigen::Vector2d expected = feature.left - Eigen::Vector2d(0.11 / depth_m, 0.0);
    visible += rig.cameras[1].project(expected).value().x() > 16.0 ? 1 : 0;
    if (!feature.right) continue;
    errors_px.push_back(rig.cameras[0].fx * (*feature.right - expected).norm());
  }
  CAPTURE(disparity_px, visible, frame.features.size());
  REQUIRE(visible > 40);
  REQUIRE(static_cast<int>(errors_px.size()) > visible * 8 / 10);
  CHECK(quantile(errors_px, 0.5) < 0.05);
  CHECK(quantile(errors_px, 0.95) < 0.2);
}

// Each row is that of an image at its own time, as a rolling shutter makes it.
GrayImage rolled(const StereoRig& rig, const TexturedPlane& plane, std::size_t side, int frame,
                 double readout_frames) {
  constexpr int kBands = 24;  // rows of a band share one pose
  GrayImage image;
  for (int band = 0; band < kBands; ++band) {
    const double late = readout_frames * ((band + 0.5) / kBands - 0.5);
    const SE3 pose = se3_exp((frame + late) * twist(0, 0, 0, 0.02, 0.01, 0));
    const StereoFrame at = plane.render(rig, pose, 0);
    const GrayImage& whole = side == 0 ? at.left : at.right;
    if (band == 0) image = whole;
    const std::ptrdiff_t rows = whole.height / kBands * whole.width;
    std::copy_n(whole.pixels.begin() + band * rows, rows, image.pixels.begin() + band * rows);
  }
  return image;
}

TEST_CASE("Bearings of a rolling shutter are moved to the stamp") {
  const StereoRig rig = test_rig();
  constexpr double kDepth_m = 2.0, kReadoutFrames = 0.6;
  const TexturedPlane plane{kDepth_m, 0.06, 3};
  TrackerConfig config = small_image_config();
  FeatureTracker as_exposed(rig, config);
  config.readout_s = kReadoutFrames * 1e-9 * static_cast<double>(kFrameNs);
  FeatureTracker at_stamp(rig, config);
  TrackedFrame exposed, moved;
  constexpr int kLast = 3;
  for (int i = 0; i <= kLast; ++i) {
    const StereoFrame frame{i * kFrameNs, rolled(rig, plane, 0, i, kReadoutFrames),
                            rolled(rig, plane, 1, i, kReadoutFrames)};
    exposed = as_exposed.track(frame, Eigen::Matrix3d::Identity());
    moved = at_stamp.track(frame, Eigen::Matrix3d::Identity());
  }
  REQUIRE(exposed.features.size() == moved.features.size());
  std::vector<double> shifts_px, errors_px, right_errors_px;
  for (std::size_t k = 0; k < moved.features.size(); ++k) {
    const Eigen::Vector2d& bearing = exposed.features[k].left;
    const double row = rig.cameras[0].project(bearing).value().y();
    const double late = kReadoutFrames * ((row + 0.5) / rig.cameras[0].height - 0.5);
    const SE3 T_world_exposed = se3_exp((kLast + late) * twist(0, 0, 0, 0.02, 0.01, 0));
    const Eigen::Vector3d p_world = T_world_exposed * (kDepth_m * bearing.homogeneous());
    const Eigen::Vector3d p_cam = sideways(kLast).inverse() * p_world;
    const double f = rig.cameras[0].fx;
    shifts_px.push_back(f * (bearing - p_cam.hnormalized()).norm());
    errors_px.push_back(f * (moved.features[k].left - p_cam.hnormalized()).norm());
    if (!moved.features[k].right) continue;
    const Eigen::Vector3d p_right = p_cam - Eigen::Vector3d(rig.baseline_m(), 0.0, 0.0);
    right_errors_px.push_back(f * (*moved.features[k].right - p_right.hnormalized()).norm());
  }
  REQUIRE(right_errors_px.size() > 40);
  CHECK(quantile(shifts_px, 0.5) > 0.3);
  CHECK(quantile(errors_px, 0.95) < 0.1);
  CHECK(quantile(right_errors_px, 0.5) < 0.15);
}

TEST_CASE("Features with a motion of their own are dropped") {
  const StereoRig rig = test_rig();
  const TexturedPlane plane;
  FeatureTracker tracker(rig, small_image_config());
  // A textured square of 90 x 90 px slides down the left image, across the epipolar lines.
  const auto frame_with_sticker = [&](int i, int top) {
    StereoFrame frame = plane.render(rig, camera_pose(i, twist(0, 0, 0, 0.01, 0, 0)), i * kFrameNs);
    for (int r = 0; r < 90; ++r) {
      for (int c = 0; c < 90; ++c) {
        const double value = smooth_noise(c / 6.0, r / 6.0, 99);
        frame.left.pixels[static_cast<std::size_t>((top + r) * frame.left.width + 100 + c)] =
            static_cast<std::uint8_t>(255.0 * value);
      }
    }
    return frame;
  };
  const Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  const auto on_sticker = [&](const TrackedFeature& feature, int top) {
    const Eigen::Vector2d px = rig.cameras[0].project(feature.left).value();
    return px.x() > 108 && px.x() < 182 && px.y() > top + 8 && px.y() < top + 82;
  };
  const TrackedFrame first = tracker.track(frame_with_sticker(0, 80), R);
  const auto there = std::count_if(first.features.begin(), first.features.end(),
                                   [&](const auto& f) { return on_sticker(f, 80); });
  REQUIRE(there >= 3);
  const TrackedFrame second = tracker.track(frame_with_sticker(1, 88), R);
  int stayed = 0;
  int tracked = 0;
  for (const TrackedFeature& feature : second.features) {
    if (feature.length < 2) continue;
    ++tracked;
    const TrackedFeature* before = find(first, feature.id);
    REQUIRE(before != nullptr);
    stayed += on_sticker(*before, 80) ? 1 : 0;
  }
  CHECK(stayed == 0);
  CHECK(tracker.statistics().motion >= there);
  CHECK(second.T_previous_current.has_value());
  CHECK(tracked > 40);
}

TEST_CASE("After a second of darkness features return under new ids") {
  const StereoRig rig = test_rig();
  const TexturedPlane plane;
  FeatureTracker tracker(rig, small_image_config());
  const Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  const StereoFrame bright = plane.render(rig, SE3::Identity(), 0);
  std::set<std::uint64_t> before;
  for (const TrackedFeature& feature : tracker.track(bright, R).features) before.insert(feature.id);
  REQUIRE(before.size() > 40);
  for (int i = 1; i <= 20; ++i) {
    const StereoFrame dark{i * kFrameNs, flat_image(rig.cameras[0], 3),
                           flat_image(rig.cameras[1], 3)};
    CHECK(tracker.track(dark, R).features.empty());
  }
  StereoFrame again = bright;
  again.stamp = 21 * kFrameNs;
  const TrackedFrame after = tracker.track(again, R);
  CHECK(after.features.size() > 40);
  for (const TrackedFeature& feature : after.features) {
    CHECK(before.count(feature.id) == 0);
    CHECK(feature.length == 1);
  }
}

StereoRig test_rgbd_rig() {
  return rgbd_rig(test_rig().cameras[0], 0.11);
}

TEST_CASE("Depth gives features the right points of a virtual camera") {
  const StereoRig rig = test_rgbd_rig();
  const TexturedPlane plane{2.0, 0.06, 3};
  FeatureTracker tracker(rig, small_image_config());
  for (int i = 0; i < 5; ++i) {
    const TrackedFrame frame = tracker.track(plane.render_rgbd(rig, sideways(i), i * kFrameNs),
                                             Eigen::Matrix3d::Identity());
    REQUIRE(frame.features.size() > 40);
    CHECK(located(frame) == static_cast<std::ptrdiff_t>(frame.features.size()));
    CHECK(frame.T_previous_current.has_value() == (i > 0));
    for (const TrackedFeature& feature : frame.features) {
      const Eigen::Vector2d expected = feature.left - Eigen::Vector2d(0.11 / 2.0, 0.0);
      // Half a millimetre of 2 m: less than a hundredth of a pixel.
      CHECK(230.0 * (*feature.right - expected).norm() < 0.01);
    }
  }
}

TEST_CASE("Holes and edges of the depth image give no right observation") {
  const StereoRig rig = test_rgbd_rig();
  const TexturedPlane plane;
  StereoFrame frame = plane.render_rgbd(rig, SE3::Identity(), 0);
  DepthImage depth = *frame.depth;
  const int hole_end = depth.width / 3, edge = 2 * depth.width / 3;
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      std::uint16_t& z_mm = depth.millimetres[static_cast<std::size_t>(y * depth.width + x)];
      if (x < hole_end) z_mm = 0;
      if (x >= edge) z_mm = 1000;
    }
  }
  frame.depth = std::make_shared<const DepthImage>(std::move(depth));
  FeatureTracker tracker(rig, small_image_config());
  const TrackedFrame result = tracker.track(frame, Eigen::Matrix3d::Identity());
  int in_hole = 0, beyond = 0;
  for (const TrackedFeature& feature : result.features) {
    const double x = rig.cameras[0].project(feature.left).value().x();
    CAPTURE(x);
    if (x < hole_end - 1) {
      ++in_hole;
      CHECK_FALSE(feature.right.has_value());
    } else if (x > edge - 1 && x < edge) {
      CHECK_FALSE(feature.right.has_value());
    } else if (x >= hole_end) {
      const double z_m = x >= edge ? 1.0 : 2.0;
      beyond += x >= edge ? 1 : 0;
      REQUIRE(feature.right.has_value());
      CHECK((feature.left - *feature.right).x() == Approx(0.11 / z_m).epsilon(1e-3));
    }
  }
  CHECK(in_hole > 10);
  CHECK(beyond > 10);
}

// White squares of 20 px every 40 px on black from (first, first) on. Their shading varies a
// little, because with equal levels a corner would tie with its neighbours.
GrayImage squares(int width, int height, int first) {
  GrayImage image{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool inside =
          x >= first && y >= first && (x - first) % 40 < 20 && (y - first) % 40 < 20;
      const int shading = (7 * x + 13 * y) % 11;
      image.pixels.push_back(static_cast<std::uint8_t>((inside ? 230 : 20) + shading));
    }
  }
  return image;
}

TEST_CASE("Detected corners are at the true corners") {
  TrackerConfig config{.max_features = 1000, .min_distance_px = 8};
  const ImagePyramid image(squares(240, 160, 30), 2, true);
  FeatureDetector detector(config);
  const auto corners = detector.detect(image, {}, 1000);
  // 6 x 4 squares, the last row and column cut: four corners each in 30..229 x 30..149.
  CHECK(corners.size() >= 4 * 5 * 3);
  for (const Eigen::Vector2f& px : corners) {
    const auto off = [](float v) {
      const float phase = std::fmod(v - 30.0F + 0.5F, 20.0F);  // Edges are between pixels.
      return std::min(phase, 20.0F - phase);
    };
    CAPTURE(px.transpose());
    CHECK(off(px.x()) < 3.0F);
    CHECK(off(px.y()) < 3.0F);
  }
}

TEST_CASE("Corners keep their distance, avoid occupied places and cover the image") {
  const StereoRig rig = test_rig();
  const GrayImage picture = TexturedPlane{}.render(rig.cameras[0], SE3::Identity());
  TrackerConfig config{.max_features = 60, .min_distance_px = 15};
  const ImagePyramid image(picture, 2, true);
  FeatureDetector detector(config);
  const std::vector<Eigen::Vector2f> occupied = {{100, 100}, {200, 50}, {103, 108}};
  const auto corners = detector.detect(image, occupied, 57);
  REQUIRE(corners.size() > 40);
  REQUIRE(corners.size() <= 57);
  std::vector<int> quadrants(4, 0);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (const Eigen::Vector2f& px : occupied) CHECK((corners[i] - px).norm() >= 15.0F);
    for (std::size_t j = 0; j < i; ++j) CHECK((corners[i] - corners[j]).norm() >= 15.0F);
    ++quadrants[(corners[i].x() > 188 ? 1U : 0U) + (corners[i].y() > 120 ? 2U : 0U)];
  }
  for (const int count : quadrants) CHECK(count >= 8);
}

}  // namespace
}  // namespace km
