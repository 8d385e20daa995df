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

TEST_CASE("What is found while the journal stops is written and handed on", "[robot]") {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / kJournal;
  Topics topics;
  Topic<PeerEvent> peer_events;
  ResultWriter results;
  JournalNode journal(file, results, JournalStart{1, 1U << kResumeBits, "toy"}, nullptr,
                      JournalTopics{.states = topics.odometry,
                                    .odometry = topics.keyframe_odometry,
                                    .new_keyframes = topics.new_keyframes,
                                    .new_closures = topics.new_closures,
                                    .new_restarts = topics.new_closure_restarts,
                                    .peer_closures = topics.shared_closures.from_peers(),
                                    .outcomes = topics.outcomes,
                                    .peer_events = peer_events,
                                    .keyframes = topics.keyframes,
                                    .closures = topics.own_closures,
                                    .restarts = topics.closure_restarts});
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
