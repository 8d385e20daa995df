#include "modules/core/geometry/lie.hpp"
#include "modules/sensors/rig_completion.hpp"
#include "test/modules/sensors/listed_bag.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

RosImu imu(const std::string& frame) {
  RosImu message;
  message.header.frame_id = frame;
  return message;
}

RosTransformStamped transform(const std::string& parent, const std::string& child,
                              const Eigen::Vector3d& position, const Eigen::Vector3d& rotation) {
  return {{0, parent}, child, {position, Eigen::Quaterniond(so3_exp(rotation))}};
}

void add_transforms(ListedBag& bag, const std::vector<RosTransformStamped>& transforms) {
  bag.add_bytes("/tf_static", RosTFMessage::kType, 0, encode_ros(RosTFMessage{transforms}));
}

// The inertial sensor is a metre above the base and rotated to its left; the left camera is in
// front.
const Eigen::Vector3d kQuarter(0, 0, std::numbers::pi / 2);
const RosTransformStamped kImuOnBase = transform("base", "imu", {0, 0, 1}, kQuarter);
const RosTransformStamped kLeftOnBase = transform("base", "left_optical", {0.2, 0, 0}, {0, 0, 0});

PartialRig nothing_known() {
  PartialRig rig;
  rig.rig.topics = {
      .left = "/left", .right = "/right", .depth = {}, .imu = "/imu", .gyro = {}, .accel = {}};
  rig.has_cameras = rig.has_extrinsics = rig.has_pair = false;
  rig.info_topics = {"/left_info", "/right_info"};
  return rig;
}

TEST_CASE("CameraInfo and static transforms complete a rig") {
  ListedBag bag;
  bag.add("/left_info", camera_info("left_optical", 0.0));
  add_transforms(bag, {kLeftOnBase});
  bag.add("/imu", imu("imu"));
  bag.add("/right_info", camera_info("left_optical", -43.0));
  add_transforms(bag, {kImuOnBase});
  const Rig rig = complete_rig("a.bag", bag, nothing_known());
  const StereoRig& stereo = rig.sensors.stereo;
  CHECK(stereo.cameras[0].fx == 458.0);
  CHECK(stereo.cameras[1].lens.coefficients()[0] == -0.28);
  CHECK(stereo.T_left_right().isApprox(make_pose(Eigen::Matrix3d::Identity(), {0.1, 0, 0})));
  // The base's x axis is the inertial sensor's -y axis: the left camera is in front of the base.
  CHECK(stereo.cameras[0].T_body_cam.translation().isApprox(Eigen::Vector3d(0, -0.2, -1)));
  CHECK((stereo.cameras[0].T_body_cam.linear() * Eigen::Vector3d::UnitX())
            .isApprox(-Eigen::Vector3d::UnitY()));
  CHECK(rig.notes.empty());
}

TEST_CASE("Raw images are rotated by R from their frame") {
  const Eigen::Matrix3d R_left = so3_exp({0.01, -0.03, 0.02}), R_right = so3_exp({-0.02, 0.01, 0});
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  RosCameraInfo left = camera_info("imu", 0.0), right = camera_info("imu", -43.0);
  Eigen::Map<RowMajor>(left.r.data()) = R_left;
  Eigen::Map<RowMajor>(right.r.data()) = R_right;
  const bool rectified = GENERATE(true, false);
  CAPTURE(rectified);
  PartialRig partial = nothing_known();
  if (rectified) partial.images = {RosImages::kRectified, RosImages::kRectified};
  partial.body_frame = "imu";
  ListedBag bag;
  bag.add("/left_info", left);
  bag.add("/right_info", right);
  const Rig rig = complete_rig("a.bag", bag, partial);
  const auto& cameras = rig.sensors.stereo.cameras;
  // A point of the rectified left camera, and its positions in the raw cameras.
  const Eigen::Vector3d p(0.4, -0.3, 2.0), in_right_rectified = p - Eigen::Vector3d(0.1, 0, 0);
  const Eigen::Vector3d in_left = rectified ? p : R_left.transpose() * p;
  const Eigen::Vector3d in_right =
      rectified ? in_right_rectified : R_right.transpose() * in_right_rectified;
  CHECK((cameras[0].T_body_cam * in_left).isApprox(p, 1e-12));
  CHECK((cameras[1].T_body_cam * in_right).isApprox(p, 1e-12));
  CHECK(cameras[0].fx == (rectified ? 430.0 : 458.0));
  CHECK(rig.notes.size() == (rectified ? 0U : 2U));
}

TEST_CASE("Poses in the rig file and CameraInfo complete a rig") {
  PartialRig partial = nothing_known();
  partial.has_extrinsics = true;
  partial.has_pair = GENERATE(true, false);
  CAPTURE(partial.has_pair);
  auto& cameras = partial.rig.sensors.stereo.cameras;
  cameras[0].T_body_cam = make_pose(so3_exp(kQuarter), {0, 0, 0.5});
  cameras[1].T_body_cam = cameras[0].T_body_cam * make_pose(so3_exp({0, 0, 0}), {0.12, 0, 0});
  ListedBag bag;
  bag.add("/left_info", camera_info("left_optical", 0.0));
  bag.add("/right_info", camera_info("left_optical", -43.0));  // a baseline of 0.1 m
  const StereoRig stereo = complete_rig("a.bag", bag, partial).sensors.stereo;
  CHECK(stereo.cameras[0].fx == 458.0);
  CHECK(stereo.cameras[0].T_body_cam.isApprox(cameras[0].T_body_cam));
  CHECK(stereo.baseline_m() == Approx(partial.has_pair ? 0.12 : 0.1));
}

// Colour and depth as a RealSense's driver publishes them.
struct DepthMessages {
  std::string frame = "color_optical";
  std::uint32_t width = 640;
  std::optional<double> info_fx = 458.0;
  std::optional<double> offset_m = std::nullopt;  // position of the depth frame
  int images = 12;
};

// Completes a rig whose calibration is known from colour images and `depth`. "" if it is complete.
std::string refusal_of_depth(const DepthMessages& depth, bool is_accepted = false) {
  PartialRig partial = nothing_known();
  partial.has_cameras = partial.has_extrinsics = partial.has_pair = true;
  partial.rig.topics.right.clear();
  partial.rig.topics.depth = "/depth";
  partial.depth_info_topic = "/depth_info";
  partial.is_depth_aligned = is_accepted;
  ListedBag bag;
  if (depth.offset_m)
    add_transforms(bag, {transform("base", "color_optical", {0, 0, 0}, {0, 0, 0}),
                         transform("base", depth.frame, {*depth.offset_m, 0, 0}, {0, 0, 0})});
  for (int k = 0; k < depth.images; ++k) {
    bag.add("/left", mono_image({0, "color_optical"}, 640, 1));
    bag.add("/depth", mono_image({0, depth.frame}, depth.width, 1));
  }
  bag.add("/left_info", camera_info("color_optical", 0.0));
  RosCameraInfo depth_info = camera_info(depth.frame, 0.0);
  depth_info.k[0] = depth.info_fx.value_or(0.0);
  if (depth.info_fx) bag.add("/depth_info", depth_info);
  try {
    static_cast<void>(complete_rig("a.bag", bag, partial));
    return "";
  } catch (const DatasetError& error) {
    return error.what();
  }
}

TEST_CASE("Depth that is not aligned with colour is refused, with the remedy") {
  struct Case {
    DepthMessages depth;
    const char* message;
  };
  const Case c = GENERATE(
      Case{{.width = 848}, "it has 848x1 px in place of 640x1"},
      Case{{.info_fx = std::nan(""), .images = 5}, "fx, fy, cx, cy of   nan   457"},
      Case{{.info_fx = 385.0, .images = 5}, "fx, fy, cx, cy of   385   457 320.5 240.5 in place"},
      Case{{.frame = "depth_optical", .info_fx = std::nullopt},
           "its frame is depth_optical, not color_optical"},
      Case{{.frame = "depth_optical", .info_fx = std::nullopt, .images = 2},
           "its frame is depth_optical, not color_optical"},
      Case{{.frame = "depth_optical", .offset_m = 0.015}, "color_optical, 15.0 mm away"});
  CHECK_THAT(refusal_of_depth(c.depth),
             Contains("/depth: depth is not aligned with the images of /left") &&
                 Contains(c.message) && Contains("align_depth.enable:=true"));
  CHECK(refusal_of_depth(c.depth, true).empty());
}

TEST_CASE("Depth is aligned if its frame, or its place and CameraInfo, are those of the images") {
  const DepthMessages depth = GENERATE(
      DepthMessages{}, DepthMessages{.frame = "/color_optical", .info_fx = std::nullopt},
      DepthMessages{.info_fx = std::nullopt, .images = 1},
      DepthMessages{.frame = "depth_optical", .offset_m = 0.0}, DepthMessages{.images = 0},
      DepthMessages{.frame = "depth_optical", .images = 5});  // no /tf_static, but equal CameraInfo
  CHECK(refusal_of_depth(depth).empty());
}

TEST_CASE("Without an inertial sensor the body is the odometry's child frame") {
  PartialRig partial = nothing_known();
  partial.rig.topics.imu.clear();
  partial.rig.topics.odometry = "/odom";
  ListedBag bag;
  bag.add("/left_info", camera_info("left_optical", 0.0));
  bag.add("/right_info", camera_info("left_optical", -43.0));
  RosOdometry odometry;
  odometry.header.frame_id = "odom";
  odometry.child_frame_id = "base";
  bag.add("/odom", odometry);
  add_transforms(bag, {kLeftOnBase});
  const StereoRig stereo = complete_rig("a.bag", bag, partial).sensors.stereo;
  CHECK(stereo.cameras[0].T_body_cam.translation().isApprox(Eigen::Vector3d(0.2, 0, 0)));
}

TEST_CASE("Calibrated cameras get the pose of their images' frame") {
  PartialRig partial = nothing_known();
  partial.has_cameras = partial.has_pair = true;
  for (Camera& camera : partial.rig.sensors.stereo.cameras) camera.fx = 300.0;
  partial.rig.sensors.stereo.cameras[1].T_body_cam.translation().x() = 0.11;
  ListedBag bag;
  bag.add("/left_info", camera_info("another", 0.0));
  bag.add("/imu", imu("base"));
  RosImage image;
  image.header = {5, "left_optical"};
  bag.add("/left", image);
  add_transforms(bag, {kLeftOnBase});
  const StereoRig stereo = complete_rig("a.bag", bag, partial).sensors.stereo;
  CHECK(stereo.cameras[0].fx == 300.0);
  CHECK(stereo.cameras[0].T_body_cam.translation().isApprox(Eigen::Vector3d(0.2, 0, 0)));
  CHECK(stereo.cameras[1].T_body_cam.translation().isApprox(Eigen::Vector3d(0.31, 0, 0)));
}

TEST_CASE("A missing part of a calibration is named with the topics that could supply it") {
  const auto complaint = [](ListedBag& bag) -> std::string {
    try {
      static_cast<void>(complete_rig("a.bag", bag, nothing_known()));
    } catch (const DatasetError& error) {
      return error.what();
    }
    return "";
  };
  ListedBag empty;
  CHECK_THAT(complaint(empty),
             Contains("a.bag: the calibration is not complete") &&
                 Contains("the left camera: sensor_msgs/CameraInfo on /left_info") &&
                 Contains("the right camera: sensor_msgs/CameraInfo on /right_info") &&
                 Contains("frame of the body: frame_id of /imu, or body_frame in the rig") &&
                 Contains("pose of the left camera on the body: /tf_static"));
  ListedBag bag;
  bag.add("/left_info", camera_info("left_optical", 0.0));
  bag.add("/right_info", camera_info("right_optical", 0.0));
  bag.add("/imu", imu("imu"));
  add_transforms(bag, {kLeftOnBase});
  CHECK_THAT(complaint(bag),
             Contains("pose of the right camera: a baseline in P of /right_info, or /tf_static "
                      "does not join left_optical and right_optical") &&
                 Contains("pose of the left camera on the body: /tf_static does not join imu and "
                          "left_optical, its frames are: base, left_optical (body_frame"));
  ListedBag uncalibrated;
  uncalibrated.add("/right_info", camera_info("right_optical", 0.0));
  uncalibrated.add("/imu", imu("imu"));
  add_transforms(uncalibrated, {});
  RosCameraInfo zero = camera_info("left_optical", 0.0);
  zero.k.fill(0.0);
  uncalibrated.add_bytes("/left_info", RosCameraInfo::kType, 1, encode_ros(zero));
  CHECK_THAT(complaint(uncalibrated), Contains("/left_info: CameraInfo of frame 'left_optical': K "
                                               "is 0: the camera is not calibrated"));
}

TEST_CASE("A chain of static transforms is followed in both directions") {
  StaticTransforms transforms;
  transforms.add(
      {{kImuOnBase, kLeftOnBase, transform("left_optical", "lens", {0, 0, 0.5}, {0, 0, 0})}});
  transforms.add({{transform("x", "y", {1, 0, 0}, {0, 0, 0})}});
  CHECK(transforms.find("imu", "lens")->translation().isApprox(Eigen::Vector3d(0, -0.2, -0.5)));
  CHECK(transforms.find("lens", "imu")->isApprox(transforms.find("imu", "lens")->inverse()));
  CHECK(transforms.find("/lens", "lens")->isApprox(SE3::Identity()));
  CHECK(!transforms.find("imu", "y"));
  // The search through a loop ends, and a transform that is not rigid is skipped.
  transforms.add({{transform("lens", "imu", {9, 9, 9}, {0, 0, 0})}});
  CHECK(!transforms.find("imu", "z"));
  RosTransformStamped bad = transform("imu", "z", {0, 0, 0}, {0, 0, 0});
  bad.transform.rotation.coeffs().setZero();
  transforms.add({{bad}});
  CHECK(!transforms.find("imu", "z"));
}

TEST_CASE("Poses come from /tf if /tf_static does not have them") {
  const bool has_static = GENERATE(false, true);  // it has other frames
  CAPTURE(has_static);
  ListedBag bag;
  if (has_static) add_transforms(bag, {transform("map", "odom", {1, 2, 3}, kQuarter)});
  bag.add("/left_info", camera_info("left_optical", 0.0));
  bag.add("/right_info", camera_info("left_optical", -43.0));
  bag.add("/imu", imu("imu"));
  bag.add_bytes("/tf", RosTFMessage::kType, 0, encode_ros(RosTFMessage{{kLeftOnBase, kImuOnBase}}));
  const Rig rig = complete_rig("a.bag", bag, nothing_known());
  CHECK(rig.sensors.stereo.cameras[0].T_body_cam.translation().isApprox(
      Eigen::Vector3d(0, -0.2, -1)));
  REQUIRE(rig.notes.size() == 1);
  CHECK_THAT(rig.notes[0], Contains("that on /tf"));
}

TEST_CASE("A baseline whose sign is wrong is named") {
  ListedBag bag;
  bag.add("/left_info", camera_info("left_optical", 0.0));
  bag.add("/right_info", camera_info("right_optical", 43.0));
  bag.add("/imu", imu("imu"));
  add_transforms(bag, {kLeftOnBase, kImuOnBase});
  CHECK_THROWS_WITH(complete_rig("a.bag", bag, nothing_known()),
                    Contains("/right_info (its P[3] is positive, and must be negative), or"));
}

TEST_CASE("A calibration that is a text is named with its topic") {
  ListedBag bag;
  add_transforms(bag, {kLeftOnBase});
  bag.describe("/left_info", "std_msgs/String");
  bag.describe("/right_info", RosCameraInfo::kType);
  bag.describe("/imu", RosImu::kType);
  CHECK_THROWS_WITH(complete_rig("a.bag", bag, nothing_known()),
                    Contains("/left_info has messages of std_msgs/String, not of "
                             "sensor_msgs/CameraInfo: state its calibration in the rig file"));
}

}  // namespace
}  // namespace km
