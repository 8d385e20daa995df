#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/pose_graph/local_graph.hpp"
#include "modules/pose_graph/newton/elimination_plan.hpp"
#include "modules/pose_graph/newton/link_cover.hpp"

namespace km {

/// What a robot knows of the pose graph: its own edges, and those to its peers, numbered from 0 in
/// each robot's block.
struct RobotEdges {
  RobotId self = 0;
  Eigen::Index poses = 0;
  std::vector<BlockEdge> own = {};
  std::map<RobotId, std::vector<InterEdge>> to = {};
  std::vector<VerticalPrior> verticals = {};  ///< Of its own poses.
};

/// Links of a robot's edges to its peers with a higher id, ascending, each once: all robots' lists
/// together are the team's links.
[[nodiscard]] std::vector<PublicLink> links_of(const RobotEdges& edges);

/// The part of the pose graph that one robot eliminates: its own poses as nodes 0 to n - 1, then
/// the cover's poses of other robots that its edges end on. Every edge between robots belongs to
/// exactly one of its two: to the one whose end is not in the cover, else to the one with the lower
/// id. Kept are the poses of the cover, and of the robot's other poses those whose elimination
/// would couple more poses than it uncouples: where a robot meets itself or the team everywhere,
/// that is most of them, and the Schur complement stays sparse.
class RobotGraph {
 public:
  /// An edge between nodes and the coupling it belongs to; transposed: its i is the coupling's j.
  struct Edge : BlockEdge {
    int pair = 0;
    bool transposed = false;
    int kept_pair = -1;  ///< In the plan's kept_pairs(), if both its nodes are kept.
  };

  /// What to keep beside the cover.
  enum class Keep { kSparse, kCoverOnly };

  /// `cover` as from cover_links(), of the whole team. If it is empty the robot is alone, and keeps
  /// its middle pose.
  /// Throws std::invalid_argument if there are no poses, if an edge names one that is not there, if
  /// a measurement is not finite or a precision not positive, or if an edge to a peer has no end in
  /// the cover. The same holds of vertical priors.
  RobotGraph(const RobotEdges& edges, std::span<const KeyframeId> cover, Keep keep = Keep::kSparse);

  /// Takes the precisions of the robot's own edges from `own`, which lists the same edges. Here
  /// they may be zero: the pattern of the plan stays.
  void set_precisions(std::span<const BlockEdge> own);

  [[nodiscard]] const std::vector<Edge>& edges() const { return edges_; }
  [[nodiscard]] const std::vector<VerticalPrior>& verticals() const { return verticals_; }
  [[nodiscard]] int nodes() const { return plan_->nodes(); }
  [[nodiscard]] const std::shared_ptr<const EliminationPlan>& plan() const { return plan_; }
  /// Which poses the plan's kept() are.
  [[nodiscard]] std::vector<KeyframeId> kept() const;
  [[nodiscard]] const KeyframeId& id(int node) const {
    return ids_[static_cast<std::size_t>(node)];
  }

 private:
  void add_edges_between(const RobotEdges& robot, std::span<const KeyframeId> cover,
                         std::vector<bool>& keep);
  void find_kept_edges();

  std::vector<Edge> edges_;
  std::vector<VerticalPrior> verticals_;
  std::vector<KeyframeId> ids_;  // of the nodes
  std::shared_ptr<const EliminationPlan> plan_;
};

}  // namespace km
