#include "apps/robot/assemblies/places.hpp"

#include <utility>

#include "apps/shipped_file.hpp"
#include "modules/loop_closure/node/loop_closure_node.hpp"
#include "modules/place_recognition/node/place_recognition_node.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"

namespace km {

Places::Places(RobotCore& core, const RobotConfig& config, RobotInput& input, JournalNode& journal)
    : core_(core) {
  Topics& t = core_.topics;
  if (!std::holds_alternative<RecordedGraph>(input.source)) {
    vocabulary_ = std::make_shared<const Vocabulary>(
        load_vocabulary(find_shipped_file(config.run.vocabulary, "run.vocabulary")));
    core_.nodes.add<PlaceRecognitionNode>(
        config.place_recognition, core_.identity.robot, vocabulary_,
        PlaceRecognitionTopics{.keyframes = t.keyframes,
                               .peer_bows = t.peer_bows,
                               .closures = t.own_closures,
                               .peer_events = core_.bridge->peers().events(),
                               .own_bows = t.bows.to_peers(),
                               .candidates = t.candidates,
                               .restarts = t.candidate_restarts,
                               .queries = t.place_queries});
  }
  if (input.localize_in) add_localization(config, *std::move(input.localize_in));
  if (input.fixes) add_fixes(*std::move(input.fixes), journal);
  add_loop_closure(config, journal);
}

void Places::add_localization(const RobotConfig& config, FinishedMap map) {
  map_id_ = map.id();
  localization_ = &core_.nodes.add<LocalizationNode>(
      MapMatcher(config.place_recognition, config.loop_closure, vocabulary_, std::move(map)),
      LocalizationTopics{.keyframes = core_.topics.keyframes,
                         .closures = core_.topics.new_closures,
                         .outcomes = core_.topics.outcomes});
}

// Keyframe 0 of a resumed run is the origin, too.
void Places::add_fixes(FixInput input, JournalNode& journal) {
  fixes_ = &core_.nodes.add_feeding<FixesNode>(
      std::move(input), FixesTopics{.states = core_.topics.odometry,
                                    .restored_states = core_.topics.restored_odometry,
                                    .keyframes = core_.topics.keyframe_odometry,
                                    .fixes = core_.topics.fixes,
                                    .received = [&](const auto& fix) { journal.append(fix); }});
}

void Places::add_loop_closure(const RobotConfig& config, JournalNode& journal) {
  Topics& t = core_.topics;
  core_.nodes.add<LoopClosureNode>(
      config.loop_closure, core_.identity.robot, vocabulary_,
      LoopClosureTopics{.keyframes = t.keyframes,
                        .candidates = t.candidates,
                        .measured_closures = t.measured_closures,
                        .peer_requests = t.requests.received,
                        .peer_replies = t.replies.received,
                        .peer_words = t.words.received,
                        .peer_closures = t.shared_closures.received,
                        .peer_events = t.ways,
                        .restarts = t.candidate_restarts,
                        .peer_bows = t.peer_bows,
                        .restored = t.restored_outcomes,
                        .own_requests = t.requests.own,
                        .own_replies = t.replies.own,
                        .own_words = t.words.own,
                        .own_closures = t.new_closures,
                        .own_restarts = t.new_closure_restarts,
                        .outcomes = t.outcomes},
      [&journal](KeyframeIndex keyframe) { return journal.recall(keyframe); });
}

}  // namespace km
