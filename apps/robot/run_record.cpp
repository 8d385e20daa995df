#include "apps/robot/run_record.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "modules/core/data/median_depth.hpp"
#include "modules/core/data/odometry_correction.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/session/own_graph.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {
namespace {

constexpr std::size_t kRecordQueue = 4096;  // far more than a module publishes in a second
constexpr std::size_t kMostInEvent = 2000;  // so that an event is far smaller than an entry may be

// Appends `whole` in events of at most kMostInEvent elements of its list.
template <typename Event, typename Element>
void append_in_parts(Event whole, std::vector<Element> Event::*list,
                     std::vector<JournalEntry>& events) {
  const std::vector<Element> all = std::exchange(whole.*list, {});
  for (std::size_t begin = 0; begin < all.size(); begin += kMostInEvent) {
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(begin);
    Event part = whole;
    (part.*list)
        .assign(first,
                first + static_cast<std::ptrdiff_t>(std::min(kMostInEvent, all.size() - begin)));
    events.emplace_back(std::move(part));
  }
}

}  // namespace

void RunRecord::add(const OdometryState& state) {
  while (!odometry_.empty() && odometry_.back().stamp >= state.stamp) odometry_.pop_back();
  odometry_.push_back({state.stamp, state.T_odom_body});
  add_live(state);
}

// Before the first solution `world` is the robot's own odometry frame.
void RunRecord::add_live(const OdometryState& state) {
  frames_.add(state);
  while (!live_.empty() && live_.back().stamp >= state.stamp) live_.pop_back();
  if (!trajectory_is_restored_)
    live_.push_back({state.stamp, frames_.T_map_odom() * state.T_odom_body});
}

void RunRecord::add(const KeyframeOdometry& keyframe) {
  ++activity_;
  frames_.add(keyframe);
  calibration_ = keyframe.calibration;
  keyframes_.push_back({.id = keyframe.id,
                        .stamp = keyframe.stamp,
                        .T_odom_kf = keyframe.T_odom_kf,
                        .T_previous_kf = keyframe.T_previous_kf,
                        .covariance = keyframe.covariance,
                        .vertical = keyframe.vertical});
}

void RunRecord::add(const Keyframe& keyframe) {
  keypoints_ += keyframe.features.keypoints.size();
  network_ = keyframe.features.network;
  if (const auto depth_m = km::median_depth_m(keyframe.features))
    median_depths_m_[keyframe.odometry.id.index] = *depth_m;
}

void RunRecord::add(const KeyframeReply& reply) {
  if (!reply.found) return;
  // The other robot answers by ORB if it has another network than this one, or none.
  if (network_ != 0 && reply.keyframe.features.network == 0)
    ++other_network_[reply.keyframe.odometry.id.robot];
  ++peer_keyframes_.keyframes;
  peer_keyframes_.keypoints += reply.keyframe.features.keypoints.size() + reply.descriptors.size();
}

void RunRecord::add(const Closure& closure) {
  ++activity_;
  if (closure.from.id.robot != robot_ && closure.to.id.robot != robot_) return;
  const RelativePose measured = closure.relative_pose();
  const auto edge = pose_edge(measured);
  if (!edge) return;  // the optimiser refuses this covariance, too
  const ClosureId id = closure.id();
  const RobotId other = id.from.robot == robot_ ? id.to.robot : id.from.robot;
  if (other != robot_ && closures_to_[other] >= OwnGraph::kMaxClosures && !closures_.contains(id))
    return;
  const auto [known, is_new] = closures_.try_emplace(id, measured);
  closures_to_[other] += is_new ? 1 : 0;
  if (!is_new && is_better(*edge, *pose_edge(known->second))) known->second = measured;
}

void RunRecord::add(const InlierSet& set) {
  ++activity_;
  if (set.a != robot_ && set.b != robot_) return;
  InlierSet& newest = inlier_sets_[{set.a, set.b}];
  if (set.version < newest.version) return;
  const InlierSet former = std::exchange(newest, set);
  for (const ClosureId& id : former.closures) judge(id);
  for (const ClosureId& id : set.closures) judge(id);
}

void RunRecord::add(const ClosureOutcome& outcome) {
  ++activity_;
  const ClosureId id = closure_id(outcome.id.from, outcome.id.to);
  (outcomes_[id] = outcome).id = id;
}

void RunRecord::add(const PlaceQuery& query) {
  if (query.status == PlaceQueryStatus::kOtherVocabulary) ++other_vocabulary_[query.query.robot];
}

void RunRecord::add(const OptimizerProgress& progress) {
  if (progress.round != progress_.round) {
    ++activity_;
    rounds_.push_back(progress);
  }
  progress_ = progress;
}

void RunRecord::add(const ClosureVerdicts& verdicts) {
  for (const WeighedClosure& closure : verdicts.closures) {
    if (closure.kept)
      rejected_.erase(closure.id);
    else
      rejected_.insert(closure.id);
    judge(closure.id);
  }
}

void RunRecord::judge(const ClosureId& id) {
  const auto set = inlier_sets_.find(std::minmax(id.from.robot, id.to.robot));
  const ClosureJudgement now{
      id, set != inlier_sets_.end() && std::ranges::binary_search(set->second.closures, id),
      rejected_.contains(id)};
  if (std::exchange(judgements_.try_emplace(id, ClosureJudgement{id}).first->second, now) != now)
    changed_judgements_.closures.push_back(now);
}

void RunRecord::add(const Trajectory& trajectory) {
  if (trajectory.robot != robot_) return;
  if (trajectory.anchor != (trajectory_ ? trajectory_->anchor : robot_)) live_.clear();
  frames_.add(trajectory);
  trajectory_ = trajectory;
  trajectory_is_restored_ = false;
  trajectory_is_stated_ = false;
}

void RunRecord::add(const PeerEvent& event) {
  if (event.kind != PeerEventKind::kRestarted) return;
  ++activity_;
  const RobotId peer = event.identity.robot;
  const auto of_peer = [&](const auto& entry) { return touches(entry.first, peer); };
  std::erase_if(closures_, of_peer);
  std::erase_if(outcomes_, of_peer);
  std::erase_if(rejected_, [&](const ClosureId& id) { return touches(id, peer); });
  std::erase_if(judgements_, of_peer);
  inlier_sets_.erase(std::minmax(robot_, peer));
  other_network_.erase(peer);
  other_vocabulary_.erase(peer);
}

void RunRecord::add(const OptimizedMesh& mesh) {
  ++activity_;
  ++mesh_corrections_.count;
  mesh_corrections_.seconds += mesh.seconds;
  mesh_corrections_.last = mesh.report;
  if (stated_cells_.anchor != mesh.anchor) stated_cells_ = {mesh.anchor, {}};
  MeshCells fresh{mesh.anchor, {}};
  const std::vector<MeshCells::Cell> cells = occupied_cells(mesh.mesh, ChunkGrid{}.cell_m);
  std::ranges::set_difference(cells, stated_cells_.cells, std::back_inserter(fresh.cells));
  std::vector<MeshCells::Cell> all;
  std::ranges::set_union(cells, stated_cells_.cells, std::back_inserter(all));
  stated_cells_.cells = std::move(all);
  append_in_parts(fresh, &MeshCells::cells, events_);
}

void RunRecord::add(const TeamSolution& solution) {
  add(solution.trajectory);
  trajectory_is_restored_ = true;
  add(solution.verdicts);
}

void RunRecord::add(const RobotSample& sample) {
  state_poses();
  events_.emplace_back(sample);
}

void RunRecord::state_poses() {
  if (!trajectory_ || std::exchange(trajectory_is_stated_, true)) return;
  if (auto changes = stated_poses_.update(*trajectory_))
    append_in_parts(*std::move(changes), &PoseChanges::poses, events_);
}

std::vector<JournalEntry> RunRecord::take_events() {
  append_in_parts(std::exchange(changed_judgements_, {}), &ClosureJudgements::closures, events_);
  return std::exchange(events_, {});
}

double RunRecord::median_depth_m(std::uint32_t keyframe) const {
  const auto found = median_depths_m_.find(keyframe);
  return found != median_depths_m_.end() ? found->second : 0.0;
}

bool RunRecord::is_inlier(const ClosureId& id) const {
  const auto known = judgements_.find(id);
  return known != judgements_.end() && known->second.is_inlier();
}

std::vector<RelativePose> RunRecord::inlier_closures() const {
  std::vector<RelativePose> result;
  for (const auto& [id, closure] : closures_)
    if (is_inlier(id)) result.push_back(closure);
  return result;
}

std::vector<ClosureOutcome> RunRecord::outcomes() const {
  std::vector<ClosureOutcome> result;
  for (auto [id, outcome] : outcomes_) {
    if (outcome.stage == ClosureStage::kVerified) {
      if (is_inlier(id))
        outcome.stage = ClosureStage::kInlier;
      else if (rejected_.contains(id))
        outcome.reason = kRejectedByOptimiser;
      else if (outcome.reason.empty())
        outcome.reason = "inconsistent with the other closures of the robot pair";
    } else if (outcome.reason.empty()) {
      outcome.reason = "the run ended first";
    }
    result.push_back(outcome);
  }
  return result;
}

std::vector<StampedPose> RunRecord::optimized_keyframes() const {
  std::vector<StampedPose> keyframes;
  const std::size_t solved = trajectory_ ? trajectory_->T_world_kf.size() : 0;
  for (std::size_t i = 0; i < std::min(solved, keyframes_.size()); ++i)
    keyframes.push_back({keyframes_[i].stamp, trajectory_->T_world_kf[i]});
  return keyframes;
}

std::vector<StampedPose> RunRecord::optimized() const {
  const std::vector<StampedPose> keyframes = optimized_keyframes();
  return odometry_.empty() ? keyframes : correct_odometry(odometry_, keyframes);
}

std::map<RobotId, ClosureTally> RunRecord::closure_tallies() const {
  std::map<RobotId, ClosureTally> result;
  for (const ClosureOutcome& outcome : outcomes()) {
    const ClosureId& id = outcome.id;
    result[id.from.robot == robot_ ? id.to.robot : id.from.robot].add(outcome.stage,
                                                                      outcome.reason);
  }
  return result;
}

RecorderNode::RecorderNode(RobotId robot, std::function<void(JournalEntry)> publish)
    : WorkerNode({.name = "recorder", .queue = kRecordQueue}),
      publish_(std::move(publish)),
      record_(robot) {}

void RecorderNode::handle(const Input& change) {
  std::vector<JournalEntry> events;
  {
    const std::lock_guard lock(mutex_);
    change();
    events = record_.take_events();
  }
  for (JournalEntry& event : events) publish_(std::move(event));
}

}  // namespace km
