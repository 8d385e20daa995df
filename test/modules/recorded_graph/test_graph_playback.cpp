#include "modules/recorded_graph/node/graph_playback_node.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kMax = std::numeric_limits<double>::infinity();

struct Played {
  Topic<KeyframeOdometry> odometry_topic;
  Topic<Keyframe> keyframe_topic;
  Topic<RelativePose> closure_topic;
  std::vector<KeyframeOdometry> odometry;
  std::vector<Keyframe> keyframes;
  std::vector<RelativePose> closures;
  std::vector<std::size_t> keyframes_before_closure;
  std::vector<GraphPlaybackEnd> ends;

  Played() {
    odometry_topic.subscribe([this](const auto& m) { odometry.push_back(*m); });
    keyframe_topic.subscribe([this](const auto& m) { keyframes.push_back(*m); });
    closure_topic.subscribe([this](const auto& m) {
      closures.push_back(*m);
      keyframes_before_closure.push_back(keyframes.size());
    });
  }
  GraphPlaybackTopics topics() {
    return {.odometry = odometry_topic,
            .keyframes = keyframe_topic,
            .closures = closure_topic,
            .end = [this](const GraphPlaybackEnd& end) { ends.push_back(end); }};
  }
};

// Robot 6 with five keyframes, closures inside it and with robots 2 and 9.
RecordedGraph recording(std::mt19937& rng) {
  RecordedGraph graph;
  graph.robot = 6;
  const auto measured = [&](KeyframeId from, KeyframeId to) {
    const SE3 T = random_pose(rng);
    return RelativePose{from, to, T, random_covariance(rng, 0.1)};
  };
  for (std::uint32_t i = 0; i < 4; ++i) graph.odometry.push_back(measured({6, i}, {6, i + 1}));
  graph.intra_closures = {measured({6, 3}, {6, 0}), measured({6, 1}, {6, 4})};
  graph.inter_closures = {measured({6, 2}, {9, 70}), measured({2, 0}, {6, 1}),
                          measured({6, 0}, {2, 5})};
  return graph;
}

void play_all(GraphPlaybackNode& node, const RecordedGraph& graph) {
  for (std::size_t i = 0; i < graph.poses(); ++i) node.step(i);
}

TEST_CASE("A played graph chains its odometry with the covariance of the chain") {
  std::mt19937 rng(1);
  const RecordedGraph graph = recording(rng);
  Played played;
  GraphPlaybackConfig config{.poses_per_second = 4.0};
  GraphPlaybackNode node(config, kMax, graph, played.topics());
  play_all(node, graph);

  REQUIRE(played.odometry.size() == 5);
  REQUIRE(played.keyframes.size() == 5);
  UncertainPose T_odom_kf;
  for (std::uint32_t i = 0; i < 5; ++i) {
    if (i > 0) {
      const RelativePose& step = graph.odometry[i - 1];
      T_odom_kf = compose(T_odom_kf, {step.T_from_to, step.covariance});
      CHECK(played.odometry[i].T_previous_kf.isApprox(step.T_from_to));
      CHECK(played.odometry[i].covariance == step.covariance);
    }
    CHECK(played.odometry[i].id == KeyframeId{6, i});
    CHECK(played.odometry[i].stamp == i * 250'000'000);
    CHECK(played.odometry[i].T_odom_kf.isApprox(T_odom_kf.T, 1e-12));
    CHECK(played.keyframes[i].stamp == played.odometry[i].stamp);
    CHECK(played.keyframes[i].odometry.id == KeyframeId{6, i});
    CHECK(played.keyframes[i].odometry.T_odom_kf.isApprox(T_odom_kf.T, 1e-12));
    CHECK(played.keyframes[i].odometry.covariance.isApprox(T_odom_kf.Sigma, 1e-12));
  }
  CHECK(played.odometry[0].covariance.isZero());
}

TEST_CASE("Keyframes of a graph with times have these times") {
  std::mt19937 rng(1);
  RecordedGraph graph = recording(rng);
  graph.stamps = {100, 250, 251, 1'000'000, 2'000'000};
  Played played;
  GraphPlaybackNode node(GraphPlaybackConfig(), kMax, graph, played.topics());
  play_all(node, graph);
  REQUIRE(played.odometry.size() == 5);
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(played.odometry[i].stamp == graph.stamps[i]);
    CHECK(played.keyframes[i].stamp == graph.stamps[i]);
  }
}

TEST_CASE("Verticals are played with their keyframes, and odometry starts upright") {
  std::mt19937 rng(2);
  RecordedGraph graph = recording(rng);
  const bool at_first = GENERATE(true, false);
  const Vertical first{random_vector<3>(rng).normalized(), 0.01};
  const Vertical third{random_vector<3>(rng).normalized(), 0.02};
  if (at_first) graph.verticals[0] = first;
  graph.verticals[2] = third;
  Played played;
  GraphPlaybackNode node(GraphPlaybackConfig{}, kMax, graph, played.topics());
  play_all(node, graph);
  CHECK(played.odometry[0].vertical.has_value() == at_first);
  CHECK_FALSE(played.odometry[1].vertical);
  REQUIRE(played.odometry[2].vertical);
  CHECK(played.odometry[2].vertical->up_body == third.up_body);
  CHECK(played.odometry[2].vertical->sigma_rad == 0.02);
  const SE3& T_odom_first = played.odometry[0].T_odom_kf;
  if (at_first)
    CHECK((T_odom_first.linear() * first.up_body - Eigen::Vector3d::UnitZ()).norm() < 1e-12);
  if (!at_first) CHECK(T_odom_first.isApprox(SE3::Identity()));
  CHECK(T_odom_first.translation().norm() == 0.0);
  CHECK(played.odometry[0].T_previous_kf.isApprox(T_odom_first));
  const std::vector<OdometryPose> poses = odometry_poses(graph);
  for (std::uint32_t i = 0; i < 5; ++i)
    CHECK(played.keyframes[i].odometry.T_odom_kf.isApprox(poses[i].T_odom_kf, 1e-12));
}

TEST_CASE("One robot plays a closure with the keyframe that makes it known") {
  std::mt19937 rng(1);
  const RecordedGraph graph = recording(rng);
  Played played;
  GraphPlaybackNode node(GraphPlaybackConfig{}, kMax, graph, played.topics());
  play_all(node, graph);

  std::vector<ClosureId> ids;
  for (const RelativePose& closure : played.closures) ids.push_back({closure.from, closure.to});
  CHECK(ids == std::vector<ClosureId>{{{6, 0}, {2, 5}},
                                      {{6, 2}, {9, 70}},
                                      {{6, 3}, {6, 0}},
                                      {{6, 1}, {6, 4}}});  // robot 2 plays 2:0 -> 6:1
  CHECK(played.keyframes_before_closure == std::vector<std::size_t>{1, 3, 4, 5});
  REQUIRE(played.ends.size() == 1);
  CHECK(played.ends[0].keyframes == 5);
  CHECK(played.ends[0].closures == 4);
}

TEST_CASE("The playback thread plays to the end at any rate") {
  const double rate = GENERATE(as<double>{}, kMax, 1e4);
  std::mt19937 rng(1);
  const RecordedGraph graph = recording(rng);
  Played played;
  std::promise<void> over;
  GraphPlaybackTopics topics = played.topics();
  topics.end = [&](const GraphPlaybackEnd& end) {
    played.ends.push_back(end);
    over.set_value();
  };
  GraphPlaybackNode node(GraphPlaybackConfig{}, rate, graph, topics);
  node.start();
  over.get_future().wait();
  node.stop();
  CHECK(node.error() == nullptr);
  CHECK(played.keyframes.size() == 5);
  CHECK(played.ends.size() == 1);
}

TEST_CASE("A stopped playback does not publish its end") {
  std::mt19937 rng(1);
  Played played;
  std::promise<void> first;
  played.keyframe_topic.subscribe([&](const auto& keyframe) {
    if (keyframe->odometry.id.index == 0) first.set_value();
  });
  GraphPlaybackNode node(GraphPlaybackConfig{}, 1e-6, recording(rng), played.topics());
  node.start();
  first.get_future().wait();
  node.stop();  // the next keyframe is due in eleven days
  CHECK(played.keyframes.size() == 1);
  CHECK(played.ends.empty());
}

TEST_CASE("A playback rate that is not positive is refused") {
  std::mt19937 rng(1);
  Played played;
  const RecordedGraph graph = recording(rng);
  for (const double rate : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS(GraphPlaybackNode(GraphPlaybackConfig{}, rate, graph, played.topics()),
                    std::invalid_argument);
}

}  // namespace
}  // namespace km
