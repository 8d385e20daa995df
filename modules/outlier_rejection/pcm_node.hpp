#pragma once

#include <cstdint>
#include <exception>
#include <map>
#include <set>
#include <string_view>

#include "modules/core/pose_graph.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Decides which closures agree, for every pair in which this robot has the lower id and for the
/// closures inside it. In: `closures`, the robot's own and received ones, in any order, repeated
/// or not. Out: `inlier_sets`, versions ascending per pair. Closures of other pairs are left to
/// their deciders, unusable ones refused with a warning.
class PcmNode final : public Node {
 public:
  /// Throws ConfigError if `config` is out of bounds. Both topics must outlive the node.
  PcmNode(const PcmConfig& config, RobotId self, Topic<Closure>& closures,
          const Topic<InlierSet>& inlier_sets);
  ~PcmNode() override { stop(); }

  std::string_view name() const override { return PcmConfig::kSection; }
  void start() override;
  /// Publishes what is left to publish.
  void stop() noexcept override;
  std::exception_ptr error() const override;
  DurationHistogram timing() const override { return worker_.timing(); }

  /// Handles one closure synchronously. The thread calls only this and publish_changes().
  void step(const Closure& closure);

  /// Publishes the sets that grew since the last call and have min_inliers.
  void publish_changes();

 private:
  using Input = Topic<Closure>::Message;  // null: time to publish
  void report(const Closure& closure, PcmVerdict verdict, const Pcm& pcm) const;

  const PcmConfig config_;
  const RobotId self_;
  const Topic<InlierSet>& inlier_sets_;
  std::map<RobotId, Pcm> pcm_of_;  // by the other robot; `self_` for closures inside this one
  std::map<RobotId, std::uint32_t> version_of_;
  std::set<RobotId> changed_;
  Worker<Input> worker_;
  Periodic ticks_;  // last member: stops before the worker it posts to
};

}  // namespace km
