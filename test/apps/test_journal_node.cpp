#include "apps/result_files.hpp"
#include "apps/robot/assemblies/robot.hpp"
#include "apps/robot/journal_node.hpp"
#include "test/support/inbox.hpp"
#include "test/support/patience.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

JournalTopics journal_topics(Topics& topics, Topic<PeerEvent>& peer_events) {
  return {.states = topics.odometry,
          .odometry = topics.keyframe_odometry,
          .new_keyframes = topics.new_keyframes,
          .new_closures = topics.new_closures,
          .new_restarts = topics.new_closure_restarts,
          .peer_closures = topics.shared_closures.received,
          .outcomes = topics.outcomes,
          .restored_outcomes = topics.restored_outcomes,
          .peer_events = peer_events,
          .keyframes = topics.keyframes,
          .closures = topics.own_closures,
          .restarts = topics.closure_restarts};
}

// A node that writes a new journal, and the content of the journal.
struct Journal {
  explicit Journal(const CameraCalibration& correction = {})
      : node(file, results, JournalStart{1, 1U << kResumeBits, "toy"}, nullptr, correction,
             journal_topics(topics, peer_events)) {
    node.start();
  }

  template <typename Entry>
  [[nodiscard]] std::vector<Entry> written() const {
    std::vector<Entry> entries;
    (void)read_journal(file, [&](const StoredEntry& stored) {
      if (const auto* found = std::get_if<Entry>(&stored.entry)) entries.push_back(*found);
    });
    return entries;
  }

  const TemporaryFolder folder;
  const fs::path file = folder.path() / kJournal;
  Topics topics;
  Topic<PeerEvent> peer_events;
  ResultWriter results;
  JournalNode node;
};

TEST_CASE("Closures found while the journal stops are written and published") {
  Journal journal;
  Inbox<Closure> passed(journal.topics.own_closures);
  Closure closure;
  closure.from.id = {1, 2};
  closure.to.id = {3, 4};
  journal.topics.new_closures.publish(closure);
  journal.node.stop();
  REQUIRE(passed.messages().size() == 1);
  CHECK(passed.messages()[0].id() == closure.id());
  const auto written = journal.written<Closure>();
  REQUIRE(written.size() == 1);
  CHECK(written[0].id() == closure.id());
}

TEST_CASE("The journal knows a published keyframe as long as its file exists") {
  Journal journal;
  Inbox<Keyframe> passed(journal.topics.keyframes);
  Keyframe keyframe;
  keyframe.odometry.id = {1, 0};
  keyframe.stamp = 17;
  CHECK(journal.node.recall(0) == nullptr);
  journal.topics.new_keyframes.publish(keyframe);
  journal.node.stop();
  REQUIRE(passed.messages().size() == 1);
  const auto recalled = journal.node.recall(0);
  REQUIRE(recalled != nullptr);
  CHECK(recalled->stamp == 17);
  CHECK(journal.node.recall(1) == nullptr);
  fs::remove(journal.file);
  CHECK(journal.node.recall(0) == nullptr);
}

TEST_CASE("Loop closure never waits for the journal that waits for it") {
  constexpr std::size_t kOutcomes = 20'000;  // more than the queue of the journal takes
  Journal journal;
  std::promise<void> answered;
  journal.topics.keyframes.subscribe([&](const auto&) {
    for (std::size_t k = 0; k < kOutcomes; ++k) journal.topics.outcomes.publish(ClosureOutcome());
    answered.set_value();
  });
  journal.topics.new_keyframes.publish(Keyframe());
  REQUIRE(answered.get_future().wait_for(kPatience) == std::future_status::ready);
  journal.node.stop();
  CHECK(journal.written<ClosureOutcome>().size() == kOutcomes);
}

TEST_CASE("The journal passes keyframes while events keep coming") {
  Journal journal;
  std::atomic<bool> passed = false;
  journal.topics.keyframes.subscribe([&](const auto&) { passed = true; });
  journal.topics.new_keyframes.publish(Keyframe());
  std::atomic<int> left = 800'000;
  {
    std::vector<std::jthread> nodes;  // so many that events come during each write
    for (int node = 0; node < 16; ++node)
      nodes.emplace_back([&] {
        while (!passed && --left > 0) {
          journal.topics.outcomes.publish(ClosureOutcome());
          std::this_thread::sleep_for(std::chrono::microseconds(1));
        }
      });
  }
  CHECK(left > 0);
}

TEST_CASE("Events of nodes that stop later are written, with their times") {
  Journal journal;
  journal.node.stop();
  journal.node.append(RobotSample{.name = "toy"});
  CHECK(journal.written<RobotSample>().empty());
  journal.node.write();
  CHECK(journal.written<RobotSample>().size() == 1);
  CHECK(journal.written<JournalStart>().size() == 2);  // in case that one is damaged
  std::vector<Stamp> times;
  (void)read_journal(journal.file,
                     [&](const StoredEntry& stored) { times.push_back(stored.time); });
  CHECK(std::ranges::is_sorted(times));
  CHECK(times.front() > 1'600'000'000'000'000'000);  // after 2020
}

TEST_CASE("A journal holds the product of all corrections of the cameras") {
  Journal journal({0.02, make_pose(Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0})});
  KeyframeOdometry keyframe;
  keyframe.id = {1, 0};
  keyframe.calibration =
      UncertainCalibration{{0.005, SE3::Identity(), 0.0}, CalibrationMatrix::Identity()};
  journal.topics.keyframe_odometry.publish(keyframe);
  journal.node.stop();
  const auto written = journal.written<KeyframeOdometry>();
  REQUIRE(written.size() == 1);
  const CameraCalibration& found = written[0].calibration.value().calibration;
  CHECK(found.offset_s == Approx(0.025));
  CHECK(found.T_body_rig.translation().x() == Approx(0.1));
}

// Nodes stop in this order.
TEST_CASE("The journal stops after all nodes that find closures and before those that use them") {
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

Closure closure_of(KeyframeId from, KeyframeId to) {
  Closure closure;
  closure.from.id = from;
  closure.to.id = to;
  return closure;
}

// Whether a place is known depends on the closures found until then.
TEST_CASE("A restored closure follows the last keyframe on which it ends") {
  constexpr RobotId kSelf = 1;
  RestoredRun run;
  run.robot = kSelf;
  for (KeyframeIndex i = 0; i < 4; ++i) {
    run.odometry.push_back({.id = {kSelf, i}});
    run.keyframes.emplace_back().odometry.id = {kSelf, i};
  }
  run.closures = {closure_of({kSelf, 3}, {kSelf, 1}), closure_of({kSelf, 0}, {kSelf, 2}),
                  closure_of({2, 70}, {kSelf, 1}), closure_of({0, 5}, {2, 9})};

  Topic<OdometryState> states;
  Topic<KeyframeOdometry> odometry;
  Topic<Keyframe> keyframes;
  Topic<Closure> own, peers;
  Topic<ClosureOutcome> outcomes;
  Topic<InlierSet> inlier_sets;
  std::string order;
  keyframes.subscribe([&](const auto& k) { order += std::to_string(k->odometry.id.index); });
  own.subscribe([&](const auto& c) { order += c->to.id.index == 1 ? 'a' : 'b'; });
  peers.subscribe([&](const auto& c) { order += c->from.id.robot == 2 ? 'c' : 'd'; });
  RestoreNode node({.states = states,
                    .odometry = odometry,
                    .keyframes = keyframes,
                    .own_closures = own,
                    .peer_closures = peers,
                    .outcomes = outcomes,
                    .inlier_sets = inlier_sets});
  node.set(std::move(run));
  node.start();
  CHECK(order == "0d1c2b3a");
}

}  // namespace
}  // namespace km
