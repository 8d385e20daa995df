#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "apps/robot/run_findings.hpp"
#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/data/live_frames.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_changes.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/data/stamped_pose.hpp"
#include "modules/core/data/team_solution.hpp"
#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/journal/journal_entry.hpp"
#include "modules/loop_closure/keyframe_requests.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/place_recognition/place_database.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "modules/vio/vio_statistics.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Data that one run leaves behind: filled by the recorder's thread, written to files by
/// write_results(). Turns what the other nodes publish into the events that journal and viewers
/// receive. Not thread-safe.
class RunRecord {
 public:
  explicit RunRecord(RobotId robot) : robot_(robot) {}

  void add(const OdometryState& state);  ///< Replaces states of this and later stamps.
  void add(const KeyframeOdometry& keyframe);
  void add(const VioStatistics& statistics) { odometry_statistics_ = statistics; }
  void add(const Keyframe& keyframe);    ///< Keyframe of this robot, for the depth that it sees.
  void add(const KeyframeReply& reply);  ///< Counts what a peer sends.
  void add(const Closure& closure);
  void add(const InlierSet& set);  ///< Kept if newer than the last set of the pair.
  void add(const ClosureOutcome& outcome);
  void add(const PlaceQuery& query);       ///< Counts keyframes that cannot be compared.
  void add(const Trajectory& trajectory);  ///< Trajectory of this robot.
  void add(const PeerEvent& event);        ///< Drops all closures with a robot that restarts.
  void add(const OptimizerProgress& progress);
  void add(const ClosureVerdicts& verdicts);
  void add(const DenseSensingProgress& progress) { dense_sensing_ = progress; }
  void add(const MappingProgress& progress) { mapping_ = progress; }
  void add(const MapMesh& /* the correction of this mesh follows */) { ++activity_; }
  void add(const OptimizedMesh& mesh);
  void add(const TeamSolution& solution);  ///< Solution of a former process.
  void add(const RobotSample& sample);     ///< Once a second; states the changed poses, too.

  /// States the poses that have changed since the last sample.
  void state_poses();

  /// Changes of decisions, poses, states and mesh since the last call, in order.
  [[nodiscard]] std::vector<JournalEntry> take_events();

  [[nodiscard]] RobotId robot() const { return robot_; }

  /// True if the optimiser has nothing left to improve, or never had.
  [[nodiscard]] bool settled() const { return keyframes_.size() < 2 || progress_.settled; }

  /// Changes with every keyframe, closure, outcome, round and mesh.
  [[nodiscard]] std::uint64_t activity() const { return activity_; }

  [[nodiscard]] const std::vector<StampedPose>& odometry() const { return odometry_; }
  /// Part of a KeyframeOdometry that is kept for every keyframe. The larger rest is kept for the
  /// last one only.
  struct RecordedKeyframe {
    KeyframeId id;
    Stamp stamp = 0;
    SE3 T_odom_kf = SE3::Identity(), T_previous_kf = SE3::Identity();
    Matrix6 covariance = Matrix6::Zero();
    std::optional<Vertical> vertical = {};
  };
  [[nodiscard]] const std::vector<RecordedKeyframe>& keyframes() const { return keyframes_; }
  /// Median depth of a keyframe's keypoints in its left camera [m]; 0: unknown.
  [[nodiscard]] double median_depth_m(std::uint32_t keyframe) const;

  /// Number of keypoints in all keyframes.
  [[nodiscard]] std::size_t keypoints() const { return keypoints_; }

  [[nodiscard]] const PeerKeyframeCounts& peer_keyframes() const { return peer_keyframes_; }

  /// Statistics of the last event; absent with an external odometry.
  [[nodiscard]] const std::optional<VioStatistics>& odometry_statistics() const {
    return odometry_statistics_;
  }
  /// Last known calibration of the cameras; absent if it is not estimated.
  [[nodiscard]] const std::optional<UncertainCalibration>& calibration() const {
    return calibration_;
  }

  /// Absent if mapping is off, or before the first frame.
  [[nodiscard]] const std::optional<DenseSensingProgress>& dense_sensing() const {
    return dense_sensing_;
  }
  [[nodiscard]] const std::optional<MappingProgress>& mapping() const { return mapping_; }

  /// Number of corrections of the mesh.
  struct MeshCorrections {
    std::size_t count = 0;
    double seconds = 0.0;             ///< Total time.
    MeshDeformationReport last = {};  ///< Report of the last optimisation.
  };
  [[nodiscard]] const MeshCorrections& mesh_corrections() const { return mesh_corrections_; }

  [[nodiscard]] const std::optional<Trajectory>& trajectory() const { return trajectory_; }
  [[nodiscard]] const OptimizerProgress& progress() const { return progress_; }

  /// State of the optimiser after each round.
  [[nodiscard]] const std::vector<OptimizerProgress>& rounds() const { return rounds_; }

  /// Relative poses of the closures that touch this robot, measured by either end. For each other
  /// robot there are at most as many as the optimiser keeps.
  [[nodiscard]] const std::map<ClosureId, RelativePose>& closures() const { return closures_; }

  /// Inlier closures of this robot, measured by itself or by its peers.
  [[nodiscard]] std::vector<RelativePose> inlier_closures() const;

  /// Every candidate of this robot in the order of ids. The newest inlier sets raise the stage to
  /// kInlier. Closures that the inlier sets lack, or that the optimiser rejected, get their reason.
  [[nodiscard]] std::vector<ClosureOutcome> outcomes() const;

  /// Poses in the team's frame: of every image, or of every keyframe if there are no images.
  [[nodiscard]] std::vector<StampedPose> optimized() const;
  /// The last optimised keyframes.
  [[nodiscard]] std::vector<StampedPose> optimized_keyframes() const;
  /// Poses of images in the team's frame as they were known when odometry estimated them: odometry
  /// since the last keyframe that was optimised by then, on its pose by then. Only those in the
  /// present frame of the team, which begin when the robot joins it, and none of a former process
  /// that had a solution.
  [[nodiscard]] const std::vector<StampedPose>& live() const { return live_; }

  /// Closures that this robot found, by the other robot (or itself): by stage, and by the reason
  /// why they went no further. The other robot may have verified a pair that this robot did not.
  [[nodiscard]] std::map<RobotId, ClosureTally> closure_tallies() const;

  /// By robot, the number of its keyframes that were compared by ORB, because its keypoints are
  /// described by another network than those of this robot.
  [[nodiscard]] const std::map<RobotId, std::uint64_t>& other_network() const {
    return other_network_;
  }

  /// By robot, the number of its keyframes that could not be compared because of its vocabulary.
  [[nodiscard]] const std::map<RobotId, std::uint64_t>& other_vocabulary() const {
    return other_vocabulary_;
  }

 private:
  [[nodiscard]] bool is_inlier(const ClosureId& id) const;
  void judge(const ClosureId& id);
  void add_live(const OdometryState& state);

  RobotId robot_;
  std::vector<StampedPose> odometry_;
  std::vector<StampedPose> live_;
  LiveFrames frames_;
  std::vector<RecordedKeyframe> keyframes_;
  std::optional<UncertainCalibration> calibration_;
  std::optional<VioStatistics> odometry_statistics_;
  std::map<std::uint32_t, double> median_depths_m_;  // median depth of each keyframe
  std::size_t keypoints_ = 0;
  PeerKeyframeCounts peer_keyframes_;
  std::map<ClosureId, RelativePose> closures_;
  std::map<RobotId, std::size_t> closures_to_;  // number of entries in `closures_` by the other
                                                // robot
  std::map<std::pair<RobotId, RobotId>, InlierSet> inlier_sets_;
  std::map<ClosureId, ClosureJudgement> judgements_;  // by inlier_sets_ and rejected_
  std::set<ClosureId> rejected_;  // closures of the inlier sets that the optimiser rejected
  std::map<ClosureId, ClosureOutcome> outcomes_;
  std::uint16_t network_ = 0;  // that of the newest own keyframe
  std::map<RobotId, std::uint64_t> other_network_, other_vocabulary_;
  std::optional<Trajectory> trajectory_;
  bool trajectory_is_restored_ = false;  // it is that of a former process
  StatedPoses stated_poses_;
  bool trajectory_is_stated_ = false;
  MeshCells stated_cells_;  // all of them, ascending
  ClosureJudgements changed_judgements_;
  std::vector<JournalEntry> events_;
  std::optional<DenseSensingProgress> dense_sensing_;
  std::optional<MappingProgress> mapping_;
  MeshCorrections mesh_corrections_;
  OptimizerProgress progress_;
  std::vector<OptimizerProgress> rounds_;
  std::uint64_t activity_ = 0;
};

/// Keeps what the other nodes publish, for the status line and the result files, and publishes the
/// events of RunRecord.
class RecorderNode final : public WorkerNode<std::function<void()>> {
 public:
  /// `publish` is called on the recorder's thread, and by stop().
  RecorderNode(RobotId robot, std::function<void(JournalEntry)> publish);
  ~RecorderNode() override { stop(); }

  /// Records everything published on these topics, for any T that RunRecord
  /// takes.
  void record(auto&&... topics) {
    const auto post = [this](const auto& message) { this->add(message); };
    (topics.subscribe(post), ...);
  }
  template <typename T>
  void add(std::shared_ptr<const T> message) {
    if (!frozen_) this->post([this, message] { record_.add(*message); });
  }

  /// Later messages are not recorded: the results stay as they are when the robot leaves.
  /// Thread-safe.
  void freeze() { frozen_ = true; }

  /// Calls `read` with the record, which no other thread changes during the call. Thread-safe.
  template <typename Reader>
  auto with_record(const Reader& read) const {
    const std::lock_guard lock(mutex_);
    return read(record_);
  }

  /// Like with_record(), except that it returns false without a call of `read` while the recorder
  /// is at work.
  template <typename Reader>
  [[nodiscard]] bool try_with_record(const Reader& read) const {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock.owns_lock()) read(record_);
    return lock.owns_lock();
  }

 private:
  void handle(const Input& change) override;
  void conclude() override {
    handle([this] { record_.state_poses(); });
  }

  const std::function<void(JournalEntry)> publish_;
  mutable std::mutex mutex_;  // guards record_
  RunRecord record_;
  std::atomic<bool> frozen_ = false;
};

}  // namespace km
