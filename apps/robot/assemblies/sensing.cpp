#include "apps/robot/assemblies/sensing.hpp"

#include <string>
#include <utility>

#include "apps/shipped_file.hpp"
#include "modules/loop_closure/node/keyframe_features_node.hpp"
#include "modules/recorded_graph/node/graph_playback_node.hpp"

namespace km {

Sensing::Sensing(RobotCore& core, const RobotConfig& config, const PlaybackPace& pace,
                 RobotInput& input)
    : core_(core) {
  if (auto* reader = std::get_if<std::unique_ptr<DatasetReader>>(&input.source))
    add_sensors(config, pace, std::move(*reader));
  else if (auto* graph = std::get_if<RecordedGraph>(&input.source))
    add_playback(config, pace.rate, std::move(*graph));
  else {
    add_restore();
    source_ended_ = true;
  }
}

void Sensing::add_sensors(const RobotConfig& config, const PlaybackPace& pace,
                          std::unique_ptr<DatasetReader> reader) {
  const SensorRig rig = reader->rig();
  const bool gives_poses = reader->gives_poses();
  Topics& t = core_.topics;
  sensors_ = &core_.nodes.add_feeding<SensorsNode>(
      config.sensors, pace, std::move(reader),
      SensorsTopics{.processed = t.processed_frames,
                    .packets = t.packets,
                    .load = t.shed_load,
                    .end = [this](const auto&) { source_ended_ = true; }});
  add_restore();
  if (gives_poses)
    add_odometry(ExternalOdometry(core_.identity.robot, rig.stereo.depth_source, config.vio));
  else
    add_odometry(Vio(core_.identity.robot, rig, config.tracker, config.vio));
  add_features(config, rig.stereo);
}

void Sensing::add_odometry(VioNode::Odometry odometry) {
  Topics& t = core_.topics;
  auto& node = core_.nodes.add_feeding<VioNode>(std::move(odometry),
                                                VioTopics{.packets = t.packets,
                                                          .odometry = t.odometry,
                                                          .keyframes = t.keyframe_odometry,
                                                          .frames = t.located_frames,
                                                          .statistics = t.odometry_statistics,
                                                          .images = t.tracked_images,
                                                          .processed = t.processed_frames});
  const std::optional<RestoredRun>& run = core_.past.run;
  if (!run) return;
  VioCheckpoint checkpoint{.state = {}, .keyframe = run->odometry.back()};
  const std::size_t states = run->final_states();
  if (core_.past.from == RestoredFrom::kFormerProcess && states > 0)
    checkpoint.state = run->states[states - 1];
  node.continue_from(checkpoint);
}

void Sensing::add_features(const RobotConfig& config, const StereoRig& rig) {
  std::optional<KeypointDescriber> keypoint_describer;
  if (const std::string& network = config.keyframe_features.network; !network.empty())
    keypoint_describer.emplace(find_shipped_file(network, "keyframe_features.network"));
  Topics& t = core_.topics;
  auto& features = core_.nodes.add_feeding<KeyframeFeaturesNode>(
      config.keyframe_features, rig,
      KeyframeFeaturesTopics{.odometry = t.keyframe_odometry,
                             .frames = t.located_frames,
                             .keyframes = t.new_keyframes},
      std::move(keypoint_describer));
  if (core_.past.run) features.continue_from(core_.past.run->keyframes.back().odometry);
}

void Sensing::add_playback(const RobotConfig& config, double rate, RecordedGraph graph) {
  Topics& t = core_.topics;
  auto& playback = core_.nodes.add_feeding<GraphPlaybackNode>(
      config.graph_playback, rate, std::move(graph),
      GraphPlaybackTopics{.odometry = t.keyframe_odometry,
                          .keyframes = t.new_keyframes,
                          .closures = t.measured_closures,
                          .end = [this](const auto&) { source_ended_ = true; }});
  if (core_.past.run) playback.continue_after(core_.past.run->keyframes.size());
  add_restore();
  core_.bridge->peers().events().subscribe(
      [to = Out<PeerEvent>(t.candidate_restarts)](const auto& event) {
        if (event->kind == PeerEventKind::kRestarted) to.publish(event);
      });
}

// Call after the source is added: the supervisor starts nodes in reverse order, so this one starts
// first.
void Sensing::add_restore() {
  if (!core_.past.run) return;
  restored_images_ = core_.past.run->final_states();
  Topics& t = core_.topics;
  restore_ = &core_.nodes.add<RestoreNode>(
      RestoreTopics{.states = t.restored_odometry,
                    .odometry = t.keyframe_odometry,
                    .keyframes = core_.past.begins_at_origin() ? t.new_keyframes : t.keyframes,
                    .own_closures = t.own_closures,
                    .peer_closures = t.closures,
                    .outcomes = t.restored_outcomes,
                    .inlier_sets = t.restored_inlier_sets});
}

void Sensing::restore_past() {
  if (restore_ != nullptr) restore_->set(*std::exchange(core_.past.run, std::nullopt));
}

}  // namespace km
