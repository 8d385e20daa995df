#include "modules/journal/restored_run.hpp"

#include <algorithm>
#include <functional>
#include <set>
#include <stdexcept>
#include <utility>

#include "modules/core/input_file.hpp"
#include "modules/core/robot_identity.hpp"

namespace km {
namespace {

bool is_final(const ClosureOutcome& outcome) {
  return outcome.stage >= ClosureStage::kVerified ||
         (outcome.stage == ClosureStage::kReceived && !outcome.reason.empty());
}

// Restores a run from the entries of its journal. A resumed process continues after the last full
// keyframe, so later entries of the former process are discarded.
class RunRestorer {
 public:
  // Throws std::invalid_argument for an entry that cannot follow the former ones.
  void take(JournalEntry entry, JournalPlace place);

  // Call once, after the last entry.
  [[nodiscard]] RestoredRun finish();

 private:
  void add(JournalStart start);
  void add(OdometryState state);
  void add(KeyframeOdometry keyframe);
  void add(Keyframe keyframe);
  void add(Closure closure);
  void add(ClosureOutcome outcome);
  void add(JournalPeer peer);
  void cut_to_full_keyframes();
  void forget_closures(const std::function<bool(const KeyframeId&)>& with);

  RestoredRun run_;
  JournalPlace place_;  // place of the present entry
  bool started_ = false;
  bool first_state_ = true;                                        // the next state is the first of
                                                                   // its process
  std::map<std::pair<KeyframeId, KeyframeId>, Closure> closures_;  // by the ends (from, to)
  std::map<ClosureId, ClosureOutcome> outcomes_;
};

void RunRestorer::take(JournalEntry entry, JournalPlace place) {
  place_ = place;
  if (!started_ && !std::holds_alternative<JournalStart>(entry))
    throw std::invalid_argument("the first entry does not state the robot of the run");
  std::visit([this](auto& value) { add(std::move(value)); }, entry);
}

void RunRestorer::add(JournalStart start) {
  if (started_ && start.robot != run_.robot)
    throw std::invalid_argument("begun by robot " + std::to_string(run_.robot) +
                                ", taken up by robot " + std::to_string(start.robot));
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

void RunRestorer::add(KeyframeOdometry keyframe) {
  if (keyframe.id != KeyframeId{run_.robot, static_cast<KeyframeIndex>(run_.odometry.size())})
    throw std::invalid_argument("keyframe " + to_string(keyframe.id) + " does not follow");
  run_.odometry.push_back(std::move(keyframe));
}

void RunRestorer::add(Keyframe keyframe) {
  const KeyframeId& id = keyframe.odometry.id;
  if (id != KeyframeId{run_.robot, static_cast<KeyframeIndex>(run_.keyframes.size())})
    throw std::invalid_argument("features of keyframe " + to_string(id) + " do not follow");
  run_.keyframes.push_back(std::move(keyframe));
  run_.places.push_back(place_);
}

void RunRestorer::add(Closure closure) {
  closures_.emplace(std::pair(closure.from.id, closure.to.id), std::move(closure));
}

void RunRestorer::add(ClosureOutcome outcome) {
  outcomes_[outcome.id] = std::move(outcome);
}

void RunRestorer::cut_to_full_keyframes() {
  const std::size_t full = std::min(run_.odometry.size(), run_.keyframes.size());
  run_.odometry.resize(full);
  run_.keyframes.resize(full);
  run_.places.resize(full);
  forget_closures([&](const KeyframeId& id) { return id.robot == run_.robot && id.index >= full; });
}

void RunRestorer::forget_closures(const std::function<bool(const KeyframeId&)>& with) {
  std::erase_if(closures_, [&](const auto& entry) {
    return with(entry.first.first) || with(entry.first.second);
  });
  std::erase_if(outcomes_,
                [&](const auto& entry) { return with(entry.first.from) || with(entry.first.to); });
}

// A new incarnation has other keyframes, so its former closures are removed.
void RunRestorer::add(JournalPeer peer) {
  const auto known = run_.peers.find(peer.robot);
  if (known != run_.peers.end() && !is_same_incarnation(known->second.boot, peer.boot))
    forget_closures([&](const KeyframeId& id) { return id.robot == peer.robot; });
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
  return std::move(run_);
}

}  // namespace

std::size_t RestoredRun::final_states() const {
  if (odometry.empty()) return 0;
  const auto later = [](Stamp stamp, const OdometryState& state) { return stamp < state.stamp; };
  const auto end = std::upper_bound(states.begin(), states.end(), odometry.back().stamp, later);
  return static_cast<std::size_t>(end - states.begin());
}

RestoredRun alone_as(RobotId robot, RestoredRun run) {
  const RobotId former = std::exchange(run.robot, robot);
  run.peers.clear();
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
  const JournalExtent read = read_journal(file, [&](JournalEntry taken, JournalPlace place) {
    ++entry;
    try {
      restorer.take(std::move(taken), place);
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
