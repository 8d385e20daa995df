#include "modules/loop_closure/node/keyframe_features_node.hpp"
#include "test/support/onnx_model.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

StereoRig small_rig() {
  Camera camera{.width = 320, .height = 240, .fx = 200.0, .fy = 200.0, .cx = 160.0, .cy = 120.0};
  return rgbd_rig(camera, 0.1);
}

LocatedFrame blank(Stamp stamp) {
  return {std::make_shared<const StereoFrame>(
              StereoFrame{stamp, {320, 240, std::vector<std::uint8_t>(320 * 240, 128)}, {}}),
          0, SE3::Identity()};
}

LocatedFrame tiled(Stamp stamp) {
  StereoFrame frame = *blank(stamp).frame;
  for (std::size_t i = 0; i < frame.left.pixels.size(); ++i)
    if ((i % 320 / 20 + i / 320 / 20) % 2 == 0) frame.left.pixels[i] = 20;
  return {std::make_shared<const StereoFrame>(std::move(frame)), 0, SE3::Identity()};
}

struct Chain {
  Topic<KeyframeOdometry> odometry;
  Topic<LocatedFrame> frames;
  Topic<Keyframe> keyframes;
  std::vector<Keyframe> published;
  KeyframeFeaturesNode node{
      {}, small_rig(), {.odometry = odometry, .frames = frames, .keyframes = keyframes}};

  Chain() {
    keyframes.subscribe([this](const auto& message) { published.push_back(*message); });
  }
};

TEST_CASE("the covariance of a keyframe is accumulated along the chain") {
  std::mt19937 rng(1);
  Chain chain;
  UncertainPose expected;
  std::vector<UncertainPose> steps;
  for (std::uint32_t i = 0; i < 20; ++i) {
    UncertainPose step{random_pose(rng, 1.0), random_covariance(rng, 0.01)};
    if (i == 0) step.Sigma.setZero();
    expected = compose(expected, step);
    steps.push_back(expected);
    chain.node.step(KeyframeOdometry{.id = {4, i},
                                     .stamp = i,
                                     .T_odom_kf = expected.T,
                                     .T_previous_kf = step.T,
                                     .covariance = step.Sigma});
    chain.node.step(blank(i));
  }
  REQUIRE(chain.published.size() == 20);
  CHECK(chain.published[0].odometry.covariance.isZero());
  for (std::size_t i = 0; i < 20; ++i) {
    const Keyframe& keyframe = chain.published[i];
    CHECK(keyframe.odometry.id == KeyframeId{4, static_cast<std::uint32_t>(i)});
    CHECK(keyframe.odometry.T_odom_kf.matrix() == steps[i].T.matrix());
    CHECK(keyframe.odometry.covariance.isApprox(steps[i].Sigma, 1e-9));  // rounding of 20 products
    CHECK(keyframe.features.keypoints.empty());
  }
}

TEST_CASE("a keyframe has the features of the image with its stamp, through the thread") {
  Chain chain;
  chain.node.start();
  // As odometry starts: several keyframes, then all images.
  chain.odometry.publish(KeyframeOdometry{.id = {4, 0}, .stamp = 10});
  chain.odometry.publish(KeyframeOdometry{.id = {4, 1}, .stamp = 30});
  chain.frames.publish(blank(10));
  chain.frames.publish(blank(20));
  chain.frames.publish(tiled(30));
  chain.frames.publish(blank(40));
  chain.node.stop();
  CHECK(chain.node.error() == nullptr);
  REQUIRE(chain.published.size() == 2);
  CHECK(chain.published[0].stamp == 10);
  CHECK(chain.published[0].features.keypoints.empty());
  CHECK(chain.published[1].stamp == 30);
  CHECK_FALSE(chain.published[1].features.keypoints.empty());
}

TEST_CASE("features are seen from where the cameras were found to be") {
  std::mt19937 rng(2);
  Chain chain;
  chain.node.step(KeyframeOdometry{.id = {4, 0}, .stamp = 10});
  LocatedFrame frame = tiled(10);
  frame.T_body_rig = random_pose(rng);
  chain.node.step(frame);
  REQUIRE(chain.published.size() == 1);
  CHECK(chain.published[0].features.T_body_cam.isApprox(frame.T_body_rig *
                                                        small_rig().cameras[0].T_body_cam));
}

}  // namespace
}  // namespace km
