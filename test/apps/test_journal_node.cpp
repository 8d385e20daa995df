#include <algorithm>
#include <catch2/catch.hpp>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "apps/result_files.hpp"
#include "apps/robot/wiring.hpp"
#include "test/support/inbox.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

JournalTopics journal_topics(Topics& topics, Topic<PeerEvent>& peer_events) {
  return {.states = topics.odometry,
          .odometry = topics.keyframe_odometry,
          .new_keyframes = topics.new_keyframes,
          .new_closures = topics.new_closures,
          .new_restarts = topics.new_closure_restarts,
          .peer_closures = topics.shared_closures.from_peers(),
          .outcomes = topics.outcomes,
          .peer_events = peer_events,
          .keyframes = topics.keyframes,
          .closures = topics.own_closures,
          .restarts = topics.closure_restarts};
}

TEST_CASE("What is found while the journal stops is written and handed on", "[robot]") {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / kJournal;
  Topics topics;
  Topic<PeerEvent> peer_events;
  ResultWriter results;
  JournalNode journal(file, results, JournalStart{1, 1U << kResumeBits, "toy"}, nullptr, {},
                      journal_topics(topics, peer_events));
  Inbox<Closure> handed_on(topics.own_closures);
  journal.start();
  Closure closure;
  closure.from.id = {1, 2};
  closure.to.id = {3, 4};
  topics.new_closures.publish(closure);
  journal.stop();
  REQUIRE(handed_on.messages().size() == 1);
  CHECK(handed_on.messages()[0].id() == closure.id());
  std::vector<ClosureId> written;
  (void)read_journal(file, [&](const JournalEntry& entry) {
    if (const auto* found = std::get_if<Closure>(&entry)) written.push_back(found->id());
  });
  CHECK(written == std::vector<ClosureId>{closure.id()});
}

TEST_CASE("A journal holds what all corrections of the cameras come to", "[robot]") {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / kJournal;
  Topics topics;
  Topic<PeerEvent> peer_events;
  ResultWriter results;
  const CameraCalibration correction{0.02, make_pose(Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0})};
  JournalNode journal(file, results, JournalStart{1, 1U << kResumeBits, "toy"}, nullptr, correction,
                      journal_topics(topics, peer_events));
  journal.start();
  KeyframeOdometry keyframe;
  keyframe.id = {1, 0};
  keyframe.calibration = UncertainCalibration{{0.005, SE3::Identity()}, Matrix7::Identity()};
  topics.keyframe_odometry.publish(keyframe);
  journal.stop();
  std::vector<CameraCalibration> written;
  (void)read_journal(file, [&](const JournalEntry& entry) {
    if (const auto* found = std::get_if<KeyframeOdometry>(&entry))
      written.push_back(found->calibration.value().calibration);
  });
  REQUIRE(written.size() == 1);
  CHECK(written[0].offset_s == Approx(0.025));
  CHECK(written[0].T_body_rig.translation().x() == Approx(0.1));
}

// Nodes stop in this order.
TEST_CASE("The journal stops behind all that find closures and before those that use them",
          "[robot]") {
  const TemporaryFolder folder;
  RobotOptions options;
  options.robot = 1;
  options.name = "robot1";
  options.output = folder.path();
  RobotConfig config;
  config.dds.interface = "lo";
  config.dds.domain = kLastQuietDomain;
  config.dds.team = "test_journal_node " + folder.path().filename().string();
  RecordedGraph graph;
  graph.robot = options.robot;
  RobotInput input{std::move(graph), "toy"};
  ResultWriter results;
  SignalWatch signals;
  const Robot robot(options, config, std::move(input), std::nullopt, results, signals);
  const auto place_of = [&](std::string_view name) {
    const auto found = std::ranges::find(robot.nodes(), name, &Node::name);
    REQUIRE(found != robot.nodes().end());
    return found - robot.nodes().begin();
  };
  CHECK(place_of("loop_closure") < place_of("journal"));
  CHECK(place_of("journal") < place_of(PcmConfig::kSection));
  CHECK(place_of("journal") < place_of("recorder"));
}

}  // namespace
}  // namespace km
