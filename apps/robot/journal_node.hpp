#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "apps/result_writer.hpp"
#include "modules/core/keyframe.hpp"
#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/journal/journal_file.hpp"
#include "modules/journal/restored_run.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of the journal node; they must outlive it.
struct JournalTopics {
  In<OdometryState> states;
  In<KeyframeOdometry> odometry;
  In<Keyframe> new_keyframes;
  In<Closure> new_closures;    ///< Found here.
  In<PeerEvent> new_restarts;  ///< In order with them: what follows is with another life.
  In<Closure> peer_closures;
  In<ClosureOutcome> outcomes;
  In<PeerEvent> peer_events;
  // The new ones in the same order, once they are on the disk.
  Out<Keyframe> keyframes;
  Out<Closure> closures;
  Out<PeerEvent> restarts;
};

/// Writes down what a robot must not lose with its process, several times a second, whatever
/// becomes of the machine. Keyframes and closures are handed on once they are written: what others
/// learn of is never forgotten, so that an index stands for one keyframe for ever, and both ends of
/// a closure know the same measurements. A disk that is full, or fails, keeps nothing back: it is
/// told, and the run goes on.
class JournalNode final : public Node {
 public:
  /// Goes on with the journal of `restored`, or begins a new one. `results` outlives this. What is
  /// found of the cameras is written on top of `correction`, by which the rig came: it holds
  /// whatever the rig of a later process is corrected by.
  JournalNode(std::filesystem::path file, ResultWriter& results, const JournalStart& start,
              const RestoredRun* restored, const CameraCalibration& correction,
              const JournalTopics& topics);
  ~JournalNode() override { stop(); }

  /// Writes that this process has the run that it goes on with: no later one takes itself for it.
  /// Call before start().
  void take_up() { step(Tick()); }

  /// A keyframe of this run as it was written; null where it is not on the disk. Thread-safe.
  [[nodiscard]] std::shared_ptr<const Keyframe> recall(KeyframeIndex keyframe) const;

  /// True while a keyframe waits for the disk. Thread-safe.
  [[nodiscard]] bool holds_back() const { return new_keyframes_ > 0; }

  std::string_view name() const override { return "journal"; }
  void start() override;
  /// Writes what is left.
  void stop() noexcept override;
  std::exception_ptr error() const override;
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  /// Disks that spin up, or wait for others, take their time.
  double step_limit_s() const override { return 120.0; }
  DurationHistogram timing() const override { return worker_.timing(); }

 private:
  struct Tick {};
  template <typename T>
  using Message = typename Topic<T>::Message;
  struct FromPeer {
    Message<Closure> closure;
  };
  using HeldBack = std::variant<Message<Keyframe>, Message<Closure>, Message<PeerEvent>>;
  using Input =
      std::variant<Tick, Message<OdometryState>, Message<KeyframeOdometry>, Message<Keyframe>,
                   Message<Closure>, FromPeer, Message<ClosureOutcome>, Message<PeerEvent>>;

  void step(Tick tick);
  void step(const Message<OdometryState>& state);
  void step(const Message<KeyframeOdometry>& odometry);
  void step(const Message<Keyframe>& keyframe);
  void step(const FromPeer& closure);
  void step(const Message<Closure>& closure);
  void step(const Message<ClosureOutcome>& outcome);
  void step(const Message<PeerEvent>& event);
  std::optional<JournalPlace> add(const JournalEntry& entry);
  void hand_on(const Message<Keyframe>& keyframe);
  void hand_on(const Message<Closure>& closure) { topics_.closures.publish(closure); }
  void hand_on(const Message<PeerEvent>& restart) { topics_.restarts.publish(restart); }

  const std::filesystem::path file_;
  ResultWriter& results_;
  const CameraCalibration correction_;
  const JournalTopics topics_;
  JournalFile journal_;
  // What a journal that is gone on with holds already: it is published once more.
  const std::size_t known_keyframes_;
  std::set<std::pair<KeyframeId, KeyframeId>> known_closures_;
  bool added_ = false;                          // since the last sync
  std::atomic<std::size_t> new_keyframes_ = 0;  // that are not handed on
  std::vector<HeldBack> held_back_;
  mutable std::mutex mutex_;          // guards places_
  std::vector<JournalPlace> places_;  // of keyframes 0, 1, ..., as far as the journal is whole
  Worker<Input> worker_;
  Periodic ticks_;  // last member: stops before the worker it posts to
};

}  // namespace km
