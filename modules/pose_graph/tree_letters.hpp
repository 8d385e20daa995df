#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/pose_graph/block_matrix.hpp"
#include "modules/pose_graph/edge_model.hpp"
#include "modules/pose_graph/pair_consensus.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// An edge between two poses that are both told on: not its second derivatives but what they are
/// made of. That is a seventh of the bytes, and single precision does no harm to soft modes:
/// rounded, it still is an edge, which resists no motion of the whole.
struct ToldEdge {
  int pair = 0;             ///< The coupling of the letter's system that it adds to.
  bool transposed = false;  ///< It leads from the second pose of that pair to the first.
  Curvature curvature = Curvature::kGaussNewton;
  float kappa = 0.0F;  ///< Before its weight.
  float tau = 0.0F;
  float weight = 1.0F;  ///< In [0, 1].
  SinglePose present;   ///< T_i_j at the poses the equations belong to.
  SinglePose measured;  ///< Of no effect on Gauss-Newton's derivatives.

  [[nodiscard]] EdgeModel model() const;
};

/// A pose that a robot leaves to those above it in the tree.
struct TreeVariable {
  KeyframeId id;
  std::uint32_t touched = 0;  ///< By how many robots of the subtree.
  std::uint32_t of = 0;       ///< Of how many in all; 0: not known in the subtree.
};

/// What a subtree's part of Newton's equations comes to, eliminated onto the poses that it leaves
/// to those above.
struct TreeSystem {
  std::vector<TreeVariable> variables = {};
  std::vector<NodePair> pairs = {};  ///< Coupled ones, in places of `variables`.
  BlockMatrix schur = {};            ///< Without the edges told as such.
  std::vector<ToldEdge> edges = {};
};

/// Two robots, and how they hang together.
struct PairVote {
  RobotId a = 0;
  RobotId b = 0;
  std::uint32_t used = 0;  ///< Closures that take part.
  PairMotion motion = {};  ///< Of b, at the start; if any are used.
};

/// Sums over a subtree.
struct TreeSums {
  double base_cost = 0.0;  ///< Before the step, with the weights it was found with.
  double cost = 0.0;       ///< After it, with the same weights.
  double decrement = 0.0;  ///< Squared norm of the forward-substituted eliminated right-hand side.
  float largest = 0.0F;    ///< Residual of a closure that may be rejected [sigma].
  std::uint32_t open = 0;  ///< Closures that may be rejected.
  std::uint32_t changed = 0;     ///< Of those: have another weight than before.
  std::uint32_t fractional = 0;  ///< Of those: are neither in nor out.
  std::uint32_t isolated = 0;    ///< Closures set aside, see Corroboration.
  std::uint32_t fixed = 0;       ///< Edges to poses that are held.
  std::uint32_t poses = 0;
  std::map<std::uint16_t, std::uint32_t> lengths = {};  ///< See NoiseHistogram; at the start only.
  std::vector<PairVote> votes = {};                     ///< Ascending by (a, b).

  void add(const TreeSums& other);
};

/// From a robot to its parent, once per round.
struct UpLetter {
  std::uint32_t round = 0;
  TreeSums sums;
  bool failed = false;  ///< The subtree cannot go on.
  /// 3 or 6 rows per variable.
  Eigen::VectorXd reduced = {};
  /// Empty: as in the round before, but for `weights`.
  std::optional<TreeSystem> system = {};
  struct NewWeight {
    std::uint32_t edge = 0;  ///< Place in the system's edges.
    float weight = 0.0F;
  };
  std::vector<NewWeight> weights = {};
};

/// What the root has made of a round.
struct TreeVerdict {
  enum class Next : std::uint8_t {
    kStep,     ///< The poses at hand are accepted; here is the next step, to take times `scale`.
    kShorten,  ///< They are not: the last step, times `scale`.
    kRefresh,  ///< Back to the accepted poses, with fresh second derivatives.
    kStart,    ///< At the very beginning: set the weights and tell the equations.
    kCount,    ///< Before that: set aside what stands alone, and count again.
    kDone,     ///< The poses at hand are accepted, and that was the last round.
    kStop,     ///< They are not: the accepted ones are the result.
  };
  enum class Weighing : std::uint8_t { kAllIn, kWeigh, kHold, kDecided };

  std::uint32_t round = 0;  ///< That is answered.
  Next next = Next::kStep;
  bool accept = false;     ///< kRefresh: the poses at hand are the accepted ones.
  bool full = false;       ///< Second derivatives told from now on are the full ones.
  bool set_aside = false;  ///< kStart: what stands alone stays aside.
  bool free = true;        ///< kStart: nothing holds the team's frame.
  Weighing weighing = Weighing::kDecided;
  double scale = 1.0;
  double mu = 0.0;    ///< Of the next weights.
  double barc = 0.0;  ///< Largest residual of an inlier [sigma].
  double noise_scale = 1.0;
  /// kCount, kStart: before anything else these robots are moved as a whole, see
  /// better_placement(). Ascending.
  std::vector<std::pair<RobotId, SinglePose>> moves = {};
  /// kStart: how strong a pair of robots is as a rule, see usual_strength(). While closures are
  /// weighed, no pair is much stronger, nor later if the rest contradicts it.
  Precision usual_pair = kUnlimited;
  double cost = 0.0;  ///< Of the team at the accepted poses.
  double gradient = 0.0;
  /// A rigid motion of everything, to first order: rotation, translation, in the world.
  std::array<double, 6> drift = {};
};

/// From a robot to a child, once per round.
struct DownLetter {
  TreeVerdict verdict;
  Eigen::VectorXd step = {};  ///< Of the child's variables; kStep only.
};

[[nodiscard]] std::vector<std::uint8_t> encode(const UpLetter& letter);
[[nodiscard]] std::vector<std::uint8_t> encode(const DownLetter& letter);
/// nullopt for anything that encode() does not make, or whose numbers are not finite.
[[nodiscard]] std::optional<UpLetter> decode_up(std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<DownLetter> decode_down(std::span<const std::uint8_t> bytes);
/// The first byte says which of the two it is.
[[nodiscard]] bool is_up_letter(std::span<const std::uint8_t> bytes);

}  // namespace km
