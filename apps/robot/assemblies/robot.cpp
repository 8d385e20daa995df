#include "apps/robot/assemblies/robot.hpp"

#include <utility>

#include "apps/result_files.hpp"
#include "apps/robot/growing_files.hpp"
#include "apps/robot/team_keys_node.hpp"

namespace km {
namespace {

std::optional<StereoRig> rig_of(const RobotInput& input) {
  const auto* reader = std::get_if<std::unique_ptr<DatasetReader>>(&input.source);
  return reader != nullptr ? std::optional((*reader)->rig().stereo) : std::nullopt;
}

int dimension_of(const RobotInput& input) {
  const auto* recorded = std::get_if<RecordedGraph>(&input.source);
  return recorded == nullptr ? 3 : recorded->dimension;
}

RobotIdentity identity_of(const RobotOptions& options, const Past& past) {
  return {.robot = options.robot, .name = options.name, .boot = past.next_boot_id()};
}

std::unique_ptr<JournalNode> journal_of(RobotCore& core, const RobotOptions& options,
                                        const RobotInput& input, ResultWriter& results) {
  Topics& t = core.topics;
  return std::make_unique<JournalNode>(
      options.output / kJournal, results,
      JournalStart{core.identity.robot, core.identity.boot, input.name},
      core.past.is_resumed ? &*core.past.run : nullptr, input.rig_correction,
      JournalTopics{.states = t.odometry,
                    .odometry = t.keyframe_odometry,
                    .new_keyframes = t.new_keyframes,
                    .new_closures = t.new_closures,
                    .new_restarts = t.new_closure_restarts,
                    .peer_closures = t.shared_closures.received,
                    .outcomes = t.outcomes,
                    .restored_outcomes = t.restored_outcomes,
                    .peer_events = core.bridge->peers().events(),
                    .keyframes = t.keyframes,
                    .closures = t.own_closures,
                    .restarts = t.closure_restarts});
}

}  // namespace

Robot::Robot(const RobotOptions& options, const RobotConfig& config, RobotInput input,
             const std::optional<MappingPlan>& mapping, ResultWriter& results, SignalWatch& signals)
    : core_{.past = Past(input),
            .identity = identity_of(options, core_.past),
            .seal = make_team_seal(options.security, core_.identity),
            .participant = DdsParticipant(config.dds, core_.identity, core_.seal),
            .nodes = nodes_},
      nodes_(signals, config.run.patience) {
  auto bridge = std::make_unique<DdsBridge>(core_.participant, config.budget);
  core_.bridge = bridge.get();
  const std::optional<StereoRig> rig = rig_of(input);
  const int dimension = dimension_of(input);
  sensing_ = std::make_unique<Sensing>(core_, config, options.pace, input);
  auto journal = journal_of(core_, options, input, results);
  journal_ = journal.get();
  places_ = std::make_unique<Places>(core_, config, input, *journal_);
  // After the nodes that find closures and before those that read them, so that none is lost at the
  // end.
  nodes_.add(std::move(journal));
  back_end_ = std::make_unique<BackEnd>(core_, config, dimension, places_->map_id());
  mapping_ = std::make_unique<Mapping>(core_, options, config, mapping, rig, std::move(input.map),
                                       results);
  records_ = std::make_unique<Records>(
      core_, Records::Sources{*journal_, *sensing_, *places_, *back_end_, *mapping_});
  records_->add_view(config.view, rig ? std::optional(rig->cameras[0]) : std::nullopt);
  if (input.ros != nullptr && config.ros.publish.value_or(true))
    records_->add_ros(std::move(input.ros));
  if (options.record) records_->add_record(options, results);
  if (core_.seal != nullptr)
    nodes_.add<TeamKeysNode>(options.security, *core_.seal, [this](const MembershipChange& change) {
      core_.bridge->apply(change);
    });
  nodes_.add(std::move(bridge));
  records_->measure_loads();
  sensing_->restore_past();
}

RunResult Robot::run(const Supervisor::Finished& finished) {
  journal_->write();
  RunResult result = nodes_.supervisor().run(finished);
  if (!result.is_left_behind(journal_->name())) journal_->write();
  return result;
}

bool Robot::input_ended() {
  return sensing_->source_ended() && nodes_.have_fed() && !journal_->holds_back();
}

void Robot::freeze_record() {
  records_->freeze();
  mapping_->finish();
}

void Robot::leave() {
  nodes_.supervisor().remove(*std::exchange(core_.bridge, nullptr));
}

}  // namespace km
