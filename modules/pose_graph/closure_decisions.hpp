#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "modules/core/closure_verdicts.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/closure_noise.hpp"
#include "modules/pose_graph/closure_places.hpp"
#include "modules/pose_graph/pose_edge.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// The decisions of sessions on the closures of one robot, and the noise of these closures. Both
/// carry over from session to session. Not thread-safe.
///
/// Some decisions are provisional: the next session of several robots begins without them. These
/// are the decisions of a robot alone, because the team knows the noise better, and decisions of a
/// team with held poses, because these poses may be wrong. Decisions of a former process are
/// provisional, too.
class ClosureDecisions {
 public:
  /// True if the closure is kept, false if it is rejected. Undecided closures have no entry.
  [[nodiscard]] const std::map<ClosureId, bool>& decided() const { return decided_; }
  [[nodiscard]] bool is_rejected(const ClosureId& id) const;
  [[nodiscard]] const ClosureNoiseRecord& noise() const { return noise_; }

  /// To be called when a session begins. If it has other members (`with_team`), discards
  /// provisional decisions and the noise that this robot has estimated alone.
  void begin_session(bool with_team);
  /// Adopts verdicts of the present session.
  void decide(std::span<const WeighedClosure> verdicts, bool provisional);
  /// Adopts the noise at the end of a session of several robots (`with_team`) or of this robot
  /// alone.
  void set_noise(ClosureNoiseRecord noise, bool with_team);
  /// Makes the rejected ones of `closures` undecided whose residual in a solution is at most
  /// kReconsiderLimit times `barc`, each at most kChances times. `pose` returns poses of the
  /// solution; closures with an end without a pose are left out. False if no closure has become
  /// undecided.
  using PoseOf = std::function<std::optional<SE3>(const KeyframeId&)>;
  bool reconsider(std::span<const PoseEdge> closures, const PoseOf& pose, double barc);
  /// Number of calls of reconsider() that made closures undecided.
  [[nodiscard]] std::uint32_t reconsidered() const { return reconsidered_; }
  /// Discards all decisions on closures with a robot whose keyframe indices have a new meaning.
  void discard(RobotId robot);

  /// All verdicts of the present session, if there are new ones since the last call.
  [[nodiscard]] std::optional<ClosureVerdicts> take_verdicts();

  /// Sets `places` and `contradicted` of an offer of these closures, by the kept ones; by all of
  /// them if none has been weighed. `all` are all closures with the same robot, offered or not.
  void count_places(EdgeSetOffer& offer, std::span<const PoseEdge> closures,
                    std::span<const AlignedOdometry> all);

 private:
  std::map<ClosureId, bool> decided_;
  std::set<ClosureId> provisional_;
  std::map<ClosureId, int> times_reconsidered_;
  std::uint32_t reconsidered_ = 0;
  ClosureNoiseRecord noise_;
  ClosureNoiseRecord team_noise_;  // noise without the sessions of this robot alone
  std::map<ClosureId, bool> verdicts_;
  bool verdicts_due_ = false;
  // Offers with `places` and `contradicted`, by the present decisions.
  std::map<std::pair<RobotId, EdgeSetId>, EdgeSetOffer> counted_;
};

}  // namespace km
