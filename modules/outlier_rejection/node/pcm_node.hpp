#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <variant>
#include <vector>

#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "modules/outlier_rejection/witnessed_pair.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the PCM node; they must outlive it.
struct PcmTopics {
  In<Closure> closures;            ///< Own and received closures, in any order, maybe repeated.
  In<KeyframeOdometry> keyframes;  ///< Keyframes of this robot; clock of witness_wait_s.
  In<PeerEvent> restarts;          ///< kRestarted, before the first closure of the new incarnation.
  In<InlierSet> restored;          ///< Sets of a former process: their robots remain joined.
  Out<InlierSet> inlier_sets;      ///< Sets with ascending versions for each pair.
};

/// Decides which closures are optimised, for every pair in which this robot has the lower id and
/// for the closures inside this robot. Closures of other pairs are ignored. Unusable closures are
/// refused with a warning.
///
/// PcmConfig::selection states the rule. By default all closures are optimised, because the
/// optimiser weighs them. Two robots are joined only when independent closures agree
/// (WitnessedPair), when PcmConfig::witness_wait_s is over, or when no witness can arrive any more.
/// A join without witnesses is logged, and needs PcmConfig::min_lone_support. The
/// wait is in sensor time, by the stamps of the robot's keyframes, so results do not depend on the
/// speed of a replay. Closures inside the robot join nothing and are published at once.
class PcmNode final
    : public WorkerNode<
          std::variant<Tick, Topic<Closure>::Message, Topic<KeyframeOdometry>::Message,
                       Topic<PeerEvent>::Message, Topic<InlierSet>::Message>> {
 public:
  /// The versions of the published sets follow `first_version`, because a resumed robot must
  /// publish newer versions than before. Throws ConfigError if `config` is out of bounds.
  PcmNode(const PcmConfig& config, RobotId self, const PcmTopics& topics,
          std::uint32_t first_version = 0);
  ~PcmNode() override { stop(); }

  /// Handle one message synchronously. The thread calls only these functions and
  /// publish_changes().
  void step(const Closure& closure);
  void step(const KeyframeOdometry& keyframe);
  void step(const PeerEvent& event);
  void step(const InlierSet& restored);

  /// Publishes the sets that have changed since the last call, and those of pairs whose wait is
  /// over.
  void publish_changes();

  /// Notes that the runs of all robots are over and all their closures have arrived. No pair waits
  /// for a witness any more, until a robot restarts. Safe to call from any thread, repeatedly.
  void expect_no_more() { no_more_ = true; }

 private:
  // Closures between this robot and another robot, or inside this robot.
  struct Pair {
    std::variant<WitnessedPair, Pcm> closures;
    std::optional<Stamp> since = {};  // stamp of the newest keyframe when the first closure came
    bool changed = false;
    bool waited = false;
  };

  void handle(const Input& input) override;
  void conclude() override { publish_changes(); }
  Pair& pair_with(RobotId other);
  [[nodiscard]] std::vector<ClosureId> selected(RobotId other, Pair& pair) const;
  [[nodiscard]] bool is_joined(RobotId other, Pair& pair) const;

  const PcmConfig config_;
  const RobotId self_;
  const std::uint32_t first_version_;
  const Out<InlierSet> inlier_sets_;
  std::map<RobotId, Pair> pairs_;  // by the other robot; `self_`: closures inside this robot
  std::map<RobotId, std::uint32_t> version_of_;
  std::optional<Stamp> newest_;  // stamp of this robot's newest keyframe
  std::atomic<bool> no_more_ = false;
};

}  // namespace km
