#include "apps/robot/journal_node.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "modules/core/io/input_file.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Long enough that a disk which stalls for a minute blocks no node.
constexpr std::size_t kJournalQueue = 16384;
// Keyframes wait for the sync, so it comes soon, but rarely enough for flash memory.
constexpr double kSyncPeriod_s = 0.5;

JournalFile begin_or_go_on(const std::filesystem::path& file, const RestoredRun* restored) {
  return restored == nullptr ? JournalFile(file) : JournalFile(file, restored->journal);
}

// Index of the last keyframe of `robot` on which the closure ends.
KeyframeIndex last_end(const Closure& closure, RobotId robot) {
  KeyframeIndex last = 0;
  for (const KeyframeId& end : {closure.from.id, closure.to.id})
    if (end.robot == robot) last = std::max(last, end.index);
  return last;
}

}  // namespace

JournalNode::JournalNode(std::filesystem::path file, ResultWriter& results,
                         const JournalStart& start, const RestoredRun* restored,
                         const CameraCalibration& correction, const JournalTopics& topics)
    : WorkerNode({.name = "journal", .queue = kJournalQueue, .tick_s = kSyncPeriod_s}),
      file_(std::move(file)),
      results_(results),
      correction_(correction),
      topics_(topics),
      journal_(begin_or_go_on(file_, restored)),
      known_keyframes_(restored == nullptr ? 0 : restored->keyframes.size()) {
  if (restored != nullptr) {
    for (const Closure& closure : restored->closures)
      known_closures_.emplace(closure.from.id, closure.to.id);
    places_ = restored->places;
  }
  for (int copy = 0; copy < 2; ++copy) add(start);  // nothing can be restored without it
  follow(topics.states, topics.odometry);
  // By the threads of their nodes: loop closure waits for no room in the queue of this node, which
  // waits for room in the queue of loop closure.
  const auto take = [this](const auto& message) { step(message); };
  topics.new_closures.subscribe(take);
  topics.new_restarts.subscribe(take);
  topics.outcomes.subscribe(take);
  topics.new_keyframes.subscribe([this](const auto& keyframe) {
    ++new_keyframes_;
    post(keyframe);
  });
  topics.peer_closures.subscribe([this](const auto& closure) { post(ClosureFromPeer{closure}); });
  if (restored == nullptr) topics.restored_outcomes.subscribe(take);
  topics.peer_events.subscribe([this](const auto& event) {
    using enum PeerEventKind;
    if (event->kind == kJoined || event->kind == kReported || event->kind == kResumed) post(event);
  });
}

std::optional<JournalPlace> JournalNode::add(const JournalEntry& entry) {
  const std::lock_guard lock(mutex_);
  return journal_.add(entry, nanoseconds(wall_now_s()));
}

// False if there is nothing to write.
bool JournalNode::collect() {
  const std::lock_guard lock(mutex_);
  return journal_.collect();
}

std::shared_ptr<const Keyframe> JournalNode::recall(KeyframeIndex keyframe) const {
  JournalPlace place;
  {
    const std::lock_guard lock(mutex_);
    if (keyframe >= places_.size()) return nullptr;
    place = places_[keyframe];
  }
  try {
    JournalEntry entry = read_journal_entry(file_, place);
    auto* const read = std::get_if<Keyframe>(&entry);
    if (read == nullptr || read->odometry.id.index != keyframe) return nullptr;
    return std::make_shared<const Keyframe>(std::move(*read));
  } catch (const InputFileError&) {
    return nullptr;  // not written yet, or the disk is gone
  }
}

void JournalNode::hold_back(HeldBack message) {
  const std::lock_guard lock(mutex_);
  held_back_.push_back(std::move(message));
}

void JournalNode::step(const Tick& /*tick*/) {
  std::vector<HeldBack> held_back;  // their entries are in the journal already
  {
    const std::lock_guard lock(mutex_);
    held_back.swap(held_back_);
  }
  if (collect())
    results_.append(file_, [this](const auto& file) {
      // First the rest that did not fit on a full disk, then all else. Events that come meanwhile
      // wait for the next tick: messages are held back until this one ends.
      for (int part = 0; part < 2 && collect(); ++part) journal_.write();
      const std::lock_guard lock(mutex_);
      if (!journal_.is_whole())
        throw std::runtime_error(file.string() +
                                 ": ends where the disk was full for too long: a resumed run "
                                 "continues from there");
    });
  for (const HeldBack& held : held_back)
    std::visit([this](const auto& message) { pass(message); }, held);
}

void JournalNode::pass(const Message<Keyframe>& keyframe) {
  topics_.keyframes.publish(keyframe);
  --new_keyframes_;
}

void JournalNode::step(const Message<OdometryState>& state) {
  add(*state);
}

void JournalNode::step(const Message<KeyframeOdometry>& odometry) {
  if (odometry->id.index < known_keyframes_) return;
  KeyframeOdometry keyframe = *odometry;
  if (keyframe.calibration)
    keyframe.calibration->calibration =
        keyframe.calibration->calibration.composed_with(correction_);
  add(keyframe);
}

void JournalNode::step(const Message<Keyframe>& keyframe) {
  if (const auto place = add(*keyframe)) {
    const std::lock_guard lock(mutex_);
    places_.push_back(*place);
  }
  hold_back(keyframe);
}

void JournalNode::step(const Message<Closure>& closure) {
  add(*closure);
  hold_back(closure);
}

void JournalNode::step(const ClosureFromPeer& from_peer) {
  const Closure& closure = *from_peer.closure;
  const auto is_new = [&] {
    const std::lock_guard lock(mutex_);
    return known_closures_.emplace(closure.from.id, closure.to.id).second;
  };
  if (is_new()) add(closure);
}

void JournalNode::step(const Message<ClosureOutcome>& outcome) {
  add(*outcome);
}

void JournalNode::step(const Message<PeerEvent>& event) {
  const RobotIdentity& peer = event->identity;
  add(JournalPeer{peer.robot, peer.boot, peer.name});
  if (event->kind != PeerEventKind::kRestarted) return;
  hold_back(event);
  const std::lock_guard lock(mutex_);
  std::erase_if(known_closures_, [&](const auto& ends) {
    return ends.first.robot == peer.robot || ends.second.robot == peer.robot;
  });
}

// A closure follows its last keyframe, as in the former process: place recognition thus knows again
// at which keyframes the place was known.
void RestoreNode::start() {
  RestoredRun run = std::exchange(run_, {});
  // Before the keyframes, so that the outcome of a candidate is known when it is found again.
  for (ClosureOutcome& outcome : run.outcomes) topics_.outcomes.publish(std::move(outcome));
  for (OdometryState& state : run.states) topics_.states.publish(std::move(state));
  const auto end_of = [&](const Closure& closure) { return last_end(closure, run.robot); };
  std::ranges::stable_sort(run.closures, {}, end_of);
  auto next = run.closures.begin();
  const auto publish_closures_until = [&](KeyframeIndex keyframe) {
    for (; next != run.closures.end() && end_of(*next) <= keyframe; ++next)
      (next->from.id.robot == run.robot ? topics_.own_closures : topics_.peer_closures)
          .publish(*next);
  };
  for (std::size_t i = 0; i < run.keyframes.size(); ++i) {
    const KeyframeIndex index = run.odometry[i].id.index;
    topics_.odometry.publish(std::move(run.odometry[i]));
    topics_.keyframes.publish(std::move(run.keyframes[i]));
    publish_closures_until(index);
  }
  publish_closures_until(std::numeric_limits<KeyframeIndex>::max());
  for (InlierSet& set : run.inlier_sets) topics_.inlier_sets.publish(std::move(set));
  log::info(name()) << run.keyframes.size() << " keyframes, " << run.closures.size()
                    << " closures restored";
}

}  // namespace km
