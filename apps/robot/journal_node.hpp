#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "apps/result_writer.hpp"
#include "modules/core/data/keyframe.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/journal/journal_file.hpp"
#include "modules/journal/restored_run.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the journal node; they must outlive it.
struct JournalTopics {
  In<OdometryState> states;
  In<KeyframeOdometry> odometry;
  In<Keyframe> new_keyframes;
  In<Closure> new_closures;  ///< Found by this robot.
  In<PeerEvent>
      new_restarts;  ///< In order with new_closures: later closures belong to a new incarnation.
  In<Closure> peer_closures;
  In<ClosureOutcome> outcomes;
  In<ClosureOutcome> restored_outcomes;  ///< Written if the journal is new.
  In<PeerEvent> peer_events;
  // Published in the same order once they are on the disk.
  Out<Keyframe> keyframes;
  Out<Closure> closures;
  Out<PeerEvent> restarts;
};

struct ClosureFromPeer {
  Topic<Closure>::Message closure;
};
using JournalInput =
    std::variant<Tick, Topic<OdometryState>::Message, Topic<KeyframeOdometry>::Message,
                 Topic<Keyframe>::Message, Topic<Closure>::Message, ClosureFromPeer,
                 Topic<ClosureOutcome>::Message, Topic<PeerEvent>::Message>;

/// Writes the events of the run to the disk, several times a second, so that they survive a crash
/// of the machine. Keyframes and closures are published only after they are written. Everything
/// that other robots receive can therefore be restored: an index always stands for one keyframe,
/// and both robots of a closure know the same measurement. If the disk is full or fails, all
/// messages are published, the failure is reported, and the run continues.
class JournalNode final : public WorkerNode<JournalInput> {
 public:
  /// Continues the journal of `restored`, or begins a new one. `results` outlives this. The
  /// estimated camera calibration is composed with `correction`, the correction already applied to
  /// the rig. The journal therefore does not depend on the correction that a later process applies
  /// to its rig.
  JournalNode(std::filesystem::path file, ResultWriter& results, const JournalStart& start,
              const RestoredRun* restored, const CameraCalibration& correction,
              const JournalTopics& topics);
  ~JournalNode() override { stop(); }

  /// Writes all entries. Before start(): the boot id of this process, so that no later process uses
  /// it again. After stop(): entries of nodes that stop later.
  void write() { step(Tick()); }

  /// Appends an event of another node. Thread-safe; does not wait for the disk.
  void append(const JournalEntry& entry) { (void)add(entry); }

  /// A keyframe of this run as it was written; null if it is not on the disk. Thread-safe.
  [[nodiscard]] std::shared_ptr<const Keyframe> recall(KeyframeIndex keyframe) const;

  /// True while a keyframe waits until it is on the disk. Thread-safe.
  [[nodiscard]] bool holds_back() const { return new_keyframes_ > 0; }

 private:
  template <typename T>
  using Message = typename Topic<T>::Message;
  using HeldBack = std::variant<Message<Keyframe>, Message<Closure>, Message<PeerEvent>>;

  void handle(const Input& input) override {
    std::visit([this](const auto& message) { step(message); }, input);
  }
  /// Writes the remaining entries.
  void conclude() override { write(); }
  void step(const Tick& tick);
  void step(const Message<OdometryState>& state);
  void step(const Message<KeyframeOdometry>& odometry);
  void step(const Message<Keyframe>& keyframe);
  void step(const ClosureFromPeer& closure);
  void step(const Message<Closure>& closure);
  void step(const Message<ClosureOutcome>& outcome);
  void step(const Message<PeerEvent>& event);
  std::optional<JournalPlace> add(const JournalEntry& entry);
  bool collect();
  void hold_back(HeldBack message);
  void pass(const Message<Keyframe>& keyframe);
  void pass(const Message<Closure>& closure) { topics_.closures.publish(closure); }
  void pass(const Message<PeerEvent>& restart) { topics_.restarts.publish(restart); }

  const std::filesystem::path file_;
  ResultWriter& results_;
  const CameraCalibration correction_;
  const JournalTopics topics_;
  JournalFile journal_;
  // Number of keyframes in the continued journal: RestoreNode publishes them once more.
  const std::size_t known_keyframes_;
  std::atomic<std::size_t> new_keyframes_ = 0;  // number of keyframes not yet published
  mutable std::mutex mutex_;  // guards the members below, and journal_ except for its write()
  std::set<std::pair<KeyframeId, KeyframeId>> known_closures_;
  std::vector<HeldBack> held_back_;
  std::vector<JournalPlace>
      places_;  // places of keyframes 0, 1, ..., up to the first that is not on the disk
};

/// Topics on which a restored run is published. All topics must outlive the node.
struct RestoreTopics {
  Out<OdometryState> states;
  Out<KeyframeOdometry> odometry;
  Out<Keyframe> keyframes;
  Out<Closure> own_closures;
  Out<Closure> peer_closures;
  Out<ClosureOutcome> outcomes;
  Out<InlierSet> inlier_sets;
};

/// Publishes a restored run once, before any source starts. The nodes that read its messages reach
/// the state that they had in the former process. Has no thread: start() returns when all messages
/// are published.
class RestoreNode final : public Node {
 public:
  explicit RestoreNode(const RestoreTopics& topics) : topics_(topics) {}

  /// Sets the run to publish. Call before start().
  void set(RestoredRun run) { run_ = std::move(run); }

  std::string_view name() const override { return "restore"; }
  void start() override;
  void stop() noexcept override {}
  std::exception_ptr error() const override { return nullptr; }

 private:
  RestoredRun run_;  // empty once it is published
  const RestoreTopics topics_;
};

}  // namespace km
