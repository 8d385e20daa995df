#pragma once

#include <map>
#include <span>
#include <vector>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/robust/corroboration.hpp"
#include "modules/robust/edge_weights.hpp"
#include "modules/robust/session_graph.hpp"
#include "modules/robust/tree_root.hpp"

namespace km {

/// The edges that one member of a session knows, and the decisions on them before the first step.
/// These are their noise, the deferred closures, and the closures that the start decides. The two
/// robots of a pair know the same closures, poses and claimed precisions, so both decide equally.
///
/// In a second look (SessionGraph::again), the deferred and rejected closures that nearly fit, or
/// that drift may explain, are undecided. A pair with undecided closures weighs its closures again,
/// except for the rejected ones. A closure to a held pose has weight 1.
///
/// Exactly one of two robots weighs a closure between them and has it among its own edges. The
/// system up the tree contains the pose at the other end. Not thread-safe.
class MemberEdges {
 public:
  /// Throws std::invalid_argument if a public pose is missing.
  MemberEdges(SessionGraph graph, TreePlace place, const TreeNewtonOptions& options);

  /// The graph without `own`. The root may have moved its poses, and its noise is the estimate.
  [[nodiscard]] const SessionGraph& graph() const { return graph_; }
  [[nodiscard]] const SE3& start_of(const KeyframeId& id) const;
  /// Ratio of the noise of the own odometry to the claimed one, by cycles through other robots.
  [[nodiscard]] double odometry_noise() const { return odometry_noise_; }

  /// The sums of this robot for the next decision of the root before the first step.
  [[nodiscard]] TreeSums count();
  /// Follows a decision of the root before the first step.
  void follow(const TreeVerdict& verdict);

  /// The edges of the front: first those that this robot weighs, then those that are not weighed.
  [[nodiscard]] FrontGraph front_graph(bool free);
  /// The weights of the first edges of front_graph(), which was called before.
  [[nodiscard]] EdgeWeights weights(const Precision& usual_pair) const;
  /// Number of rejected closures of `front` that drift may explain: see Corroboration::possible().
  /// `weights`: from weights(). `present`: poses of the nodes of `front`.
  [[nodiscard]] std::uint32_t count_possible(const EdgeWeights& weights, const FrontEdges& front,
                                             std::span<const SE3> present, double barc) const;
  /// On all closures that this robot reports, by the final `weights`.
  [[nodiscard]] ClosureVerdicts verdicts(const EdgeWeights& weights) const;

 private:
  /// kFixed: not weighed. kOpen: may be rejected. kRejected: by the first look.
  enum class Trust { kFixed, kOpen, kRejected };
  /// An edge that this robot knows. The other robot of the edge may be the one that weighs it.
  struct Known {
    PoseEdge edge;
    bool odometry = false;
    Trust trust = Trust::kFixed;
    bool deferred = false;  ///< Stands alone: deferred in this session.
    bool settled = false;   ///< Decided by the start, see EdgeWeight.
    bool fits = true;       ///< The decision by the start.
    bool own = true;        ///< This robot weighs it.
  };
  using Indices = std::vector<std::size_t>;

  [[nodiscard]] static bool takes_part(const Known& k) {
    return k.trust != Trust::kRejected && !k.deferred;
  }
  [[nodiscard]] bool reports(const Known& k) const;
  [[nodiscard]] std::map<RobotId, Indices> by_peer() const;
  [[nodiscard]] std::vector<PoseEdge> select(const Indices& closures, auto&& condition) const;
  [[nodiscard]] Corroboration corroboration(std::span<const PoseEdge> closures,
                                            const Corroboration::PoseOf& pose) const;
  void for_cycles(auto&& visit);
  [[nodiscard]] std::pair<Precision, Precision> closure_precisions(RobotId peer);
  void reopen();
  void classify();
  [[nodiscard]] PairVote vote_on(RobotId peer, const Indices& closures, bool first) const;
  void weaken_odometry();
  void weigh_by_noise(double noise_scale);
  void weigh_by_usual_noise(double usual, double noise_scale);
  void move_robots(const std::vector<std::pair<RobotId, SinglePose>>& moves);
  void settle(double barc);
  void find_isolated(const TreeVerdict& verdict);
  void share_closures(std::map<KeyframeIndex, std::uint32_t>& touched_by);

  SessionGraph graph_;
  TreePlace place_;
  TreeNewtonOptions options_;
  std::size_t inside_ = 0;    // number of edges inside this robot
  std::vector<Known> known_;  // these edges, then those between robots
  bool counted_ = false;      // count() has been called
  bool lengths_due_ = false;  // count() is to count the lengths of cycles
  bool noise_known_ = false;  // weigh_by_noise() has been called
  double odometry_noise_ = 1.0;
};

}  // namespace km
