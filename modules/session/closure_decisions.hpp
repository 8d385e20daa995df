#pragma once

#include <map>
#include <optional>
#include <span>
#include <utility>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/ids.hpp"
#include "modules/robust/closure_places.hpp"
#include "modules/session/team_messages.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// The verdicts of the last session on the closures of one robot, and those of earlier sessions on
/// closures to robots that were not its members. Sessions do not begin with them. Not thread-safe.
class ClosureDecisions {
 public:
  /// True if the closure is kept, false if it is rejected. Undecided closures have no entry.
  [[nodiscard]] const std::map<ClosureId, bool>& decided() const { return decided_; }
  [[nodiscard]] bool is_rejected(const ClosureId& id) const;

  /// To be called when a session ends: discards the verdicts on closures between its members.
  void begin_result(std::span<const RobotId> members);
  /// Adopts verdicts of the last session.
  void decide(std::span<const WeighedClosure> verdicts);
  /// Discards all decisions on closures with a robot whose keyframe indices have a new meaning.
  void discard(RobotId robot);

  /// All verdicts, if there are new ones since the last call.
  [[nodiscard]] std::optional<ClosureVerdicts> take_verdicts();

  /// Sets `places` and `contradicted` of an offer of these closures, by the kept ones; by all of
  /// them if none has been weighed. `all` are all closures with the same robot, offered or not.
  void count_places(EdgeSetOffer& offer, std::span<const PoseEdge> closures,
                    std::span<const AlignedOdometry> all);

 private:
  std::map<ClosureId, bool> decided_;
  bool verdicts_due_ = false;
  // Offers with `places` and `contradicted`, by the present decisions.
  std::map<std::pair<RobotId, EdgeSetId>, EdgeSetOffer> counted_;
};

}  // namespace km
