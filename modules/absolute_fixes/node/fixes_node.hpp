#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <variant>
#include <vector>

#include "modules/absolute_fixes/fix_association.hpp"
#include "runtime/guarded_thread.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Fixes of a recording, or the live topic of them.
struct FixInput {
  FixReader reader;
  std::vector<TimedPosition> recorded = {};   ///< With a live topic: those of the former process.
  std::unique_ptr<BagReader> live = nullptr;  ///< Null for a recording.
};

/// Channels of the node; they must outlive it.
struct FixesTopics {
  In<OdometryState> states;
  In<OdometryState> restored_states;
  In<KeyframeOdometry> keyframes;  ///< Keyframe 0 is the origin of the absolute frame.
  Out<PositionFix> fixes;
  /// Called for each usable live fix, for the journal.
  std::function<void(const ReceivedFix&)> received;
};

/// Measures keyframes by absolute fixes (FixAssociation), in a thread. A second thread waits for
/// live fixes.
class FixesNode final
    : public WorkerNode<
          std::variant<Topic<OdometryState>::Message, Topic<KeyframeOdometry>::Message,
                       std::shared_ptr<const BagMessage>>> {
 public:
  FixesNode(FixInput input, const FixesTopics& topics);
  ~FixesNode() override { stop(); }

  std::exception_ptr error() const override {
    return first_of({WorkerNode::error(), receiver_.error()});
  }

  /// Handles one input synchronously. The thread calls only this function.
  void step(const Input& input);

  /// Thread-safe.
  [[nodiscard]] FixCounts counts() const;
  [[nodiscard]] std::optional<GeodeticPoint> datum() const;

 private:
  void handle(const Input& input) override { step(input); }
  void start_sources() override;
  void stop_sources() noexcept override;
  void receive();

  mutable std::mutex mutex_;  // guards reader_ and association_
  FixReader reader_;
  FixAssociation association_;
  std::unique_ptr<BagReader> live_;
  const FixesTopics topics_;
  GuardedThread receiver_;
};

}  // namespace km
