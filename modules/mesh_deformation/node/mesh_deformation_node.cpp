#include "modules/mesh_deformation/node/mesh_deformation_node.hpp"

#include <algorithm>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Larger than the number of messages during any correction, so that publishers do not wait.
constexpr std::size_t kQueue = 8192;

// Number of ticks in MeshDeformationConfig::period_s. A tick starts a due correction, which is
// therefore late by at most the interval of the ticks.
constexpr double kTicksPerPeriod = 8.0;

// Number of keyframes that must be known for a map: one more than the last that saw a vertex.
std::size_t keyframes_of(const MapMesh& map) {
  KeyframeIndex last = 0;
  for (const auto& seen : map.seen_by) last = std::max(last, seen[1]);
  return map.seen_by.empty() ? 0 : std::size_t{last} + 1;
}

}  // namespace

MeshDeformationNode::MeshDeformationNode(const MeshDeformationConfig& config, RobotId self,
                                         const MeshDeformationTopics& topics)
    : WorkerNode({.name = MeshDeformationConfig::kSection,
                  .queue = kQueue,
                  .tick_s = checked(config).period_s / kTicksPerPeriod,
                  .in_background = true}),
      config_(config),
      self_(self),
      optimized_(topics.optimized),
      superseded_(topics.superseded),
      corrector_(config) {
  follow(topics.keyframes);
  topics.maps.subscribe([this](const auto& map) {
    latest_map_.put(map);
    ++arrived_;
  });
  topics.trajectory.subscribe([this](const auto& newest) {
    latest_trajectory_.put(newest);
    ++arrived_;
  });
}

void MeshDeformationNode::finish() {
  latest_map_.close();
  latest_trajectory_.close();
  post(MeshEnd());  // the worker refuses it after stop()
}

void MeshDeformationNode::handle(const Input& input) {
  const double now_s = steady_now_s();
  take_latest(now_s);
  step(input, now_s);
}

void MeshDeformationNode::take_latest(double now_s) {
  handled_ = arrived_;  // before take(): what is counted is there
  if (auto map = latest_map_.take()) step(std::move(map), now_s);
  if (auto trajectory = latest_trajectory_.take()) step(std::move(trajectory), now_s);
}

void MeshDeformationNode::step(const Input& input, double now_s) {
  if (ended_) return;
  if (const auto* keyframe = std::get_if<Topic<KeyframeOdometry>::Message>(&input))
    return take(**keyframe);
  if (const auto* map = std::get_if<Topic<MapMesh>::Message>(&input)) return take(*map);
  if (const auto* trajectory = std::get_if<Topic<Trajectory>::Message>(&input)) {
    trajectory_ = *trajectory;
    if (!trajectory_->covariances.empty()) solved_ = trajectory_;
    return;
  }
  ended_ = std::holds_alternative<MeshEnd>(input);
  if (ended_ || now_s >= next_s_) correct();
}

void MeshDeformationNode::take(const KeyframeOdometry& keyframe) {
  if (keyframe.id.index != T_odom_kf_.size())
    throw std::invalid_argument("mesh deformation: keyframe " + std::to_string(keyframe.id.index) +
                                " after " + std::to_string(T_odom_kf_.size()) + " keyframes");
  T_odom_kf_.push_back(keyframe.T_odom_kf);
}

void MeshDeformationNode::take(Topic<MapMesh>::Message map) {
  keyframes_of_map_ = keyframes_of(*map);
  map_ = std::move(map);
  ++map_version_;
}

// A map may arrive before its keyframes, and the trajectory may be missing.
bool MeshDeformationNode::can_correct() const {
  return map_ != nullptr && trajectory_ != nullptr && !trajectory_->T_world_kf.empty() &&
         !T_odom_kf_.empty() && keyframes_of_map_ <= T_odom_kf_.size();
}

CorrectionInput MeshDeformationNode::input() const {
  const auto& T_world_kf = trajectory_->T_world_kf;
  const std::span<const Matrix6> covariances =
      solved_ ? std::span(solved_->covariances) : std::span<const Matrix6>();
  return {*map_, map_version_, T_odom_kf_,
          std::span(T_world_kf).first(std::min(T_world_kf.size(), T_odom_kf_.size())),
          covariances.first(std::min({covariances.size(), T_world_kf.size(), T_odom_kf_.size()}))};
}

void MeshDeformationNode::correct() {
  const bool has_mesh =
      map_ != nullptr && trajectory_ != nullptr && !trajectory_->T_world_kf.empty();
  if (!has_mesh) corrected_ = handled_;
  if (!can_correct()) {
    if (ended_ && map_ != nullptr)
      log::warn(name()) << "the last map is not corrected: it was made with " << keyframes_of_map_
                        << " keyframes; " << T_odom_kf_.size() << " and "
                        << (trajectory_ == nullptr ? 0 : trajectory_->T_world_kf.size())
                        << " optimised ones are known";
    return;
  }
  const double start_s = steady_now_s();
  std::optional<MeshCorrection> correction =
      ended_ ? corrector_.correct_from_scratch(input()) : corrector_.correct(input());
  if (!correction) {
    corrected_ = handled_;
    return;
  }
  const double end_s = steady_now_s();
  // Corrections take at most a tenth of the time, however large the map is.
  constexpr double kPauseShare = 9.0;
  next_s_ = end_s + std::max(config_.period_s, kPauseShare * (end_s - start_s));
  timing_.add(end_s - start_s);
  OptimizedMesh result{*std::move(correction), self_, trajectory_->anchor, trajectory_,
                       end_s - start_s};
  for (std::size_t k = 0; k < result.origin.T_world_kf.size(); ++k)
    result.T_world_odom.push_back(result.origin.T_world_kf[k] * T_odom_kf_[k].inverse());
  if (!result.superseded.vertices.empty())
    superseded_.publish(std::exchange(result.superseded, {}));
  report(result);
  optimized_.publish(std::move(result));
  corrected_ = handled_;  // not before the mesh is published
}

void MeshDeformationNode::report(const OptimizedMesh& result) const {
  const MeshDeformationReport& report = result.report;
  log::debug(name()) << report.vertices << " vertices, " << report.nodes << " nodes, "
                     << report.keyframes << " keyframes: " << to_string(report.status) << " after "
                     << report.iterations << " iterations, " << result.superseded_faces
                     << " faces seen again, " << result.seen_through << " seen through, "
                     << result.seconds << " s";
  if (report.status == DeformationStatus::kFailed)
    log::limited(log::Level::kWarn, name(), "failed")
        << "the deformation graph of " << report.nodes
        << " nodes could not be solved: the mesh follows its keyframes roughly";
}

}  // namespace km
