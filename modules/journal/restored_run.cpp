#include "modules/journal/restored_run.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "modules/core/io/input_file.hpp"
#include "modules/core/robot_identity.hpp"

namespace km {
namespace {

// Maximum number of consecutive lost keyframes that are filled in. A damaged disk block has far
// fewer.
constexpr std::size_t kMostLost = 1000;

bool is_final(const ClosureOutcome& outcome) {
  return outcome.stage >= ClosureStage::kVerified ||
         (outcome.stage == ClosureStage::kReceived && !outcome.reason.empty());
}

// Keyframe `number` (from 1) of the `count` keyframes lost between `before` and `next`. The last of
// them has its exact pose, because `next` states the step from it. The others have the rotation of
// the last one, and interpolated positions.
KeyframeOdometry lost_keyframe(const KeyframeOdometry* before, const KeyframeOdometry& next,
                               std::size_t number, std::size_t count) {
  KeyframeOdometry lost = next;
  const SE3 T_odom_last = next.T_odom_kf * next.T_previous_kf.inverse();
  const SE3 T_odom_before = before != nullptr ? before->T_odom_kf : T_odom_last;
  const Stamp begin =
      before != nullptr ? before->stamp : next.stamp - static_cast<Stamp>(count) - 1;
  const double share = static_cast<double>(number) / static_cast<double>(count);
  lost.id.index = next.id.index - static_cast<KeyframeIndex>(count + 1 - number);
  lost.stamp =
      begin + (next.stamp - begin) * static_cast<Stamp>(number) / static_cast<Stamp>(count + 1);
  lost.T_odom_kf = make_pose(T_odom_last.linear(), (1.0 - share) * T_odom_before.translation() +
                                                       share * T_odom_last.translation());
  lost.vertical.reset();
  lost.state_covariance.reset();
  lost.calibration.reset();
  return lost;
}

}  // namespace

void RunRestorer::take(StoredEntry stored) {
  place_ = stored.place;
  after_damage_ |= stored.after_damage;
  if (!started_ && !std::holds_alternative<JournalStart>(stored.entry))
    throw std::invalid_argument("the first entry does not state the robot of the run");
  std::visit([this](auto& value) { add(std::move(value)); }, stored.entry);
}

void RunRestorer::add(JournalStart start) {
  if (started_ && start.robot != run_.robot)
    throw std::invalid_argument("started by robot " + std::to_string(run_.robot) +
                                ", continued by robot " + std::to_string(start.robot));
  cut_to_full_keyframes();
  started_ = first_state_ = true;
  run_.robot = start.robot;
  run_.boot = start.boot;
  run_.input = std::move(start.input);
}

// States that a resumed process has estimated replace those of the former process.
void RunRestorer::add(OdometryState state) {
  if (std::exchange(first_state_, false))
    std::erase_if(run_.states, [&](const auto& former) { return former.stamp >= state.stamp; });
  if (!run_.states.empty() && state.stamp <= run_.states.back().stamp)
    throw std::invalid_argument("a pose is not later than the one before");
  run_.states.push_back(std::move(state));
}

// True if keyframe `id` is the next one after those of `before`. False if damage of the journal can
// explain that keyframes between them are missing. Otherwise throws.
template <typename T>
bool RunRestorer::is_next(const KeyframeId& id, const std::vector<T>& before) const {
  const std::size_t next = before.size();
  if (id == KeyframeId{run_.robot, static_cast<KeyframeIndex>(next)}) return true;
  const bool is_gap = id.robot == run_.robot && id.index > next && id.index - next <= kMostLost;
  if (after_damage_ && is_gap) return false;
  throw std::invalid_argument("keyframe " + to_string(id) + " does not follow");
}

void RunRestorer::add(KeyframeOdometry keyframe) {
  if (!is_next(keyframe.id, run_.odometry)) {
    const std::size_t first = run_.odometry.size(), count = keyframe.id.index - first;
    for (std::size_t k = 1; k <= count; ++k) {
      const KeyframeOdometry* const before = first > 0 ? &run_.odometry[first - 1] : nullptr;
      KeyframeOdometry lost = lost_keyframe(before, keyframe, k, count);
      lost.T_previous_kf = run_.odometry.empty()
                               ? lost.T_odom_kf
                               : run_.odometry.back().T_odom_kf.inverse() * lost.T_odom_kf;
      run_.odometry.push_back(std::move(lost));
    }
    run_.lost_keyframes += count;
  }
  run_.odometry.push_back(std::move(keyframe));
}

void RunRestorer::add(Keyframe keyframe) {
  if (!is_next(keyframe.odometry.id, run_.keyframes)) {
    Keyframe lost = keyframe;
    lost.features.keypoints.clear();
    lost.features.descriptors.clear();
    lost.features.matched.clear();
    for (; run_.keyframes.size() < keyframe.odometry.id.index; ++run_.lost_keyframes) {
      lost.odometry.id.index = static_cast<KeyframeIndex>(run_.keyframes.size());
      run_.keyframes.push_back(lost);
      run_.places.emplace_back();
    }
  }
  run_.keyframes.push_back(std::move(keyframe));
  run_.places.push_back(place_);
}

void RunRestorer::add(Closure closure) {
  closures_.emplace(std::pair(closure.from.id, closure.to.id), std::move(closure));
}

void RunRestorer::add(ClosureOutcome outcome) {
  outcomes_[outcome.id] = std::move(outcome);
}

void RunRestorer::add(const ClosureJudgements& judgements) {
  for (const ClosureJudgement& closure : judgements.closures) judgements_[closure.id] = closure;
}

void RunRestorer::add(const PoseChanges& changes) {
  if (std::exchange(anchor_, changes.anchor) != changes.anchor) poses_.clear();
  for (const PoseChanges::Pose& pose : changes.poses) poses_[pose.id] = pose;
}

void RunRestorer::cut_to_full_keyframes() {
  const std::size_t full = std::min(run_.odometry.size(), run_.keyframes.size());
  run_.odometry.resize(full);
  run_.keyframes.resize(full);
  run_.places.resize(full);
  forget(run_.robot, static_cast<KeyframeIndex>(full));
}

// Discards results with keyframes of `robot` from an index on.
void RunRestorer::forget(RobotId robot, KeyframeIndex from) {
  const auto is_gone = [&](const KeyframeId& id) { return id.robot == robot && id.index >= from; };
  const auto has_gone = [&](const auto& entry) {
    return is_gone(entry.first.from) || is_gone(entry.first.to);
  };
  std::erase_if(closures_, [&](const auto& entry) {
    return is_gone(entry.first.first) || is_gone(entry.first.second);
  });
  std::erase_if(outcomes_, has_gone);
  std::erase_if(judgements_, has_gone);
  std::erase_if(poses_, [&](const auto& entry) { return is_gone(entry.first); });
}

// A new incarnation of a robot has other keyframes, so results with its former keyframes are
// removed.
void RunRestorer::add(JournalPeer peer) {
  const auto known = run_.peers.find(peer.robot);
  if (known != run_.peers.end() && !is_same_incarnation(known->second.boot, peer.boot))
    forget(peer.robot, 0);
  run_.peers[peer.robot] = std::move(peer);
}

RestoredRun RunRestorer::finish() {
  cut_to_full_keyframes();
  std::set<ClosureId> known;
  for (auto& [ends, closure] : closures_) {
    known.insert(closure.id());
    run_.closures.push_back(std::move(closure));
  }
  for (auto& [id, outcome] : outcomes_) {
    const bool verified = outcome.stage >= ClosureStage::kVerified;
    const bool has_closure = known.contains(closure_id(id.from, id.to));
    if (is_final(outcome) && (!verified || has_closure))
      run_.outcomes.push_back(std::move(outcome));
  }
  std::erase_if(judgements_, [&](const auto& entry) { return !known.contains(entry.first); });
  finish_decisions();
  finish_solution();
  return std::move(run_);
}

void RunRestorer::finish_decisions() {
  std::map<std::pair<RobotId, RobotId>, InlierSet> sets;
  for (const auto& [id, judgement] : judgements_) {
    if (!judgement.selected) continue;
    InlierSet& set = sets[{id.from.robot, id.to.robot}];
    set.a = id.from.robot;
    set.b = id.to.robot;
    set.closures.push_back(id);
    run_.solution.verdicts.closures.push_back({id, !judgement.overruled});
  }
  for (auto& [pair, set] : sets) run_.inlier_sets.push_back(std::move(set));
}

// Own poses after a missing one are left out.
void RunRestorer::finish_solution() {
  Trajectory& trajectory = run_.solution.trajectory;
  trajectory.robot = run_.robot;
  trajectory.anchor = anchor_;
  for (const auto& [id, pose] : poses_) {
    if (id.robot != run_.robot) {
      trajectory.public_poses[id] = pose.T_world_kf;
    } else if (id.index == trajectory.T_world_kf.size()) {
      if (pose.covariance && id.index == trajectory.covariances.size())
        trajectory.covariances.push_back(*pose.covariance);
      trajectory.T_world_kf.push_back(pose.T_world_kf);
    }
  }
  for (const auto& [robot, peer] : run_.peers) run_.solution.peers.push_back({robot, peer.boot});
}

std::size_t RestoredRun::final_states() const {
  if (odometry.empty()) return 0;
  const auto later = [](Stamp stamp, const OdometryState& state) { return stamp < state.stamp; };
  const auto end = std::upper_bound(states.begin(), states.end(), odometry.back().stamp, later);
  return static_cast<std::size_t>(end - states.begin());
}

RestoredRun alone_as(RobotId robot, RestoredRun run) {
  const RobotId former = std::exchange(run.robot, robot);
  run.peers.clear();
  run.inlier_sets.clear();
  run.fixes.clear();
  run.solution = {};
  const auto is_shared = [former](const KeyframeId& a, const KeyframeId& b) {
    return a.robot != former || b.robot != former;
  };
  std::erase_if(run.closures, [&](const Closure& c) { return is_shared(c.from.id, c.to.id); });
  std::erase_if(run.outcomes, [&](const auto& o) { return is_shared(o.id.from, o.id.to); });
  for (KeyframeOdometry& keyframe : run.odometry) {
    keyframe.id.robot = robot;
    keyframe.calibration.reset();
  }
  for (Keyframe& keyframe : run.keyframes) keyframe.odometry.id.robot = robot;
  for (Closure& closure : run.closures) closure.from.id.robot = closure.to.id.robot = robot;
  for (ClosureOutcome& outcome : run.outcomes) outcome.id.from.robot = outcome.id.to.robot = robot;
  return run;
}

RestoredRun restore_run(const std::filesystem::path& file) {
  RunRestorer restorer;
  std::size_t entry = 0;
  const JournalExtent read = read_journal(file, [&](StoredEntry stored) {
    ++entry;
    try {
      restorer.take(std::move(stored));
    } catch (const std::invalid_argument& error) {
      throw InputFileError(file.string() + ": entry " + std::to_string(entry) + ": " +
                           error.what());
    }
  });
  RestoredRun run = restorer.finish();
  run.journal = read;
  return run;
}

}  // namespace km
