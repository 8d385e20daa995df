#include <catch2/catch.hpp>

#include "modules/loop_closure/keyframe_features_node.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

struct Chain {
  Topic<KeyframeOdometry> odometry;
  Topic<Keyframe> keyframes;
  std::vector<Keyframe> published;
  KeyframeFeaturesNode node{{}, std::nullopt, odometry, keyframes};

  Chain() {
    keyframes.subscribe([this](const auto& message) { published.push_back(*message); });
  }
};

TEST_CASE("the covariance of a keyframe is accumulated along the chain",
          "[keyframe_features_node]") {
  std::mt19937 rng(1);
  Chain chain;
  UncertainPose expected;
  std::vector<UncertainPose> steps;
  for (std::uint32_t i = 0; i < 20; ++i) {
    UncertainPose step{random_pose(rng, 1.0), random_covariance(rng, 0.01)};
    if (i == 0) step.Sigma.setZero();
    expected = compose(expected, step);
    steps.push_back(expected);
    chain.node.step({.id = {4, i},
                     .stamp = i,
                     .T_odom_kf = expected.T,
                     .T_previous_kf = step.T,
                     .covariance = step.Sigma,
                     .frame = nullptr});
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

TEST_CASE("keyframes out of order, and images without a rig, are misuse",
          "[keyframe_features_node]") {
  Chain chain;
  KeyframeOdometry odometry;
  odometry.id.index = 1;
  CHECK_THROWS_AS(chain.node.step(odometry), std::invalid_argument);
  odometry.id.index = 0;
  odometry.frame = std::make_shared<const StereoFrame>();
  CHECK_THROWS_AS(chain.node.step(odometry), std::invalid_argument);
  odometry.frame = nullptr;
  chain.node.step(odometry);
  CHECK(chain.published.size() == 1);
}

}  // namespace
}  // namespace km
