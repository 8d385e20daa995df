#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "modules/core/data/team_solution.hpp"
#include "modules/journal/journal_entry.hpp"
#include "modules/journal/journal_file.hpp"

namespace km {

/// A run up to the last keyframe of which its journal has both odometry and features. Odometry
/// continues from the image of that keyframe.
struct RestoredRun {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Boot id of the last process.
  std::string input;       ///< Input of the robot, see JournalStart.

  std::vector<KeyframeOdometry> odometry;  ///< Index i is keyframe i.
  std::vector<Keyframe> keyframes;         ///< Index i is keyframe i, as in `odometry`.
  /// Places of the keyframes in the journal; size 0: not there.
  std::vector<JournalPlace> places;
  /// States of all images. States after the last keyframe stay until they are estimated again.
  std::vector<OdometryState> states;
  std::vector<Closure> closures;  ///< Closures of this robot and of others, each once.
  /// Final outcomes of candidates: those verified whose closures are known, and those refused.
  std::vector<ClosureOutcome> outcomes;
  std::vector<ReceivedFix> fixes;        ///< Live fixes, in the order of their arrival.
  std::map<RobotId, JournalPeer> peers;  ///< Last known identities.

  std::vector<InlierSet> inlier_sets = {};  ///< Selected ones of `closures`, as version 0.
  TeamSolution solution = {};               ///< Last solution in the journal; may have no poses.

  JournalExtent journal = {};      ///< Position at which writing continues.
  std::size_t lost_keyframes = 0;  ///< Keyframes of which damage has left only a part.

  /// Number of states up to the last keyframe; 0 without one.
  [[nodiscard]] std::size_t final_states() const;
};

/// Restores a run from the entries of its journal in order. A resumed process continues after the
/// last keyframe with odometry and features, so later entries of the former process are discarded.
/// After damage, the pose of a lost keyframe follows from its neighbours, and lost features are
/// empty.
class RunRestorer {
 public:
  /// Throws std::invalid_argument for an entry that cannot follow the former ones.
  void take(StoredEntry stored);

  /// Call once, after the last entry.
  [[nodiscard]] RestoredRun finish();

 private:
  void add(JournalStart start);
  void add(OdometryState state);
  void add(KeyframeOdometry keyframe);
  void add(Keyframe keyframe);
  void add(Closure closure);
  void add(ClosureOutcome outcome);
  void add(JournalPeer peer);
  void add(const ClosureJudgements& judgements);
  void add(const PoseChanges& changes);
  void add(const RobotSample& /*sample*/) {}
  void add(const MeshCells& /*cells*/) {}
  void add(ReceivedFix fix) { run_.fixes.push_back(fix); }
  template <typename T>
  bool is_next(const KeyframeId& id, const std::vector<T>& before) const;
  void cut_to_full_keyframes();
  void forget(RobotId robot, KeyframeIndex from);
  void finish_decisions();
  void finish_solution();

  RestoredRun run_;
  JournalPlace place_;  // place of the present entry
  bool after_damage_ = false;
  bool started_ = false;
  bool first_state_ = true;                                        // the next state is the first of
                                                                   // its process
  std::map<std::pair<KeyframeId, KeyframeId>, Closure> closures_;  // by the ends (from, to)
  std::map<ClosureId, ClosureOutcome> outcomes_;
  std::map<ClosureId, ClosureJudgement> judgements_;
  RobotId anchor_ = 0;
  std::map<KeyframeId, PoseChanges::Pose> poses_;
};

/// The run with another robot id, without calibrations and without results with other robots.
[[nodiscard]] RestoredRun alone_as(RobotId robot, RestoredRun run);

/// Reads the journal of a run. Throws InputFileError, also for entries that contradict each other.
[[nodiscard]] RestoredRun restore_run(const std::filesystem::path& file);

}  // namespace km
