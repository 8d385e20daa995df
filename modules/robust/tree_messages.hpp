#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/robust/pair_consensus.hpp"
#include "modules/tree_newton/tree_system.hpp"

namespace km {

/// Two robots, and the closures between them.
struct PairVote {
  RobotId a = 0;
  RobotId b = 0;
  std::uint32_t used = 0;  ///< Number of closures in use.
  PairMotion motion = {};  ///< Motion of b at the start; set if `used` > 0.
  float noise = 0.0F;      ///< PairCycles::factor; 0: not estimated yet, or from too few places.
  /// See odometry_evidence(); in the first round only.
  std::vector<float> odometry = {};
};

/// The pull of the closures of a limited pair a < b in one direction, see TreeRoot.
struct PairPull {
  RobotId a = 0;
  RobotId b = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();  ///< Weighed errors of their positions.
  double weight = 0.0;                            ///< Sum of the weights.
  double closures = 0.0;                          ///< Number of closures, limited as the pair is.
};

/// Sums over a subtree.
struct TreeSums {
  double base_cost = 0.0;  ///< Cost before the step, with the weights of the step.
  double cost = 0.0;       ///< Cost after the step, with the weights of the step.
  double decrement = 0.0;  ///< Squared norm of the forward-substituted eliminated right-hand side.
  float largest = 0.0F;    ///< Largest residual of an open closure [sigma].
  float largest_of_all = 0.0F;  ///< The same with settled and deferred closures; at the start only.
  std::uint32_t open = 0;       ///< Number of closures that may be rejected.
  std::uint32_t changed = 0;    ///< Open closures whose weight has changed.
  std::uint32_t fractional = 0;  ///< Open closures with a weight between 0 and 1.
  std::uint32_t kept = 0;        ///< Closures with a weight above one half.
  std::uint32_t rejected = 0;    ///< Open closures between robots with a lower weight.
  std::uint32_t left = 0;     ///< Closures for a second look: deferred, or rejected and possible.
  std::uint32_t fixed = 0;    ///< Number of edges to held poses.
  std::uint32_t dropped = 0;  ///< Closures with a weight of at most one half, or without.
  std::uint32_t doubted = 0;  ///< Closures that a doubt has changed, see EdgeWeights::doubt().
  std::uint32_t poses = 0;
  std::map<std::uint16_t, std::uint32_t> lengths = {};  ///< See NoiseHistogram; at the start only.
  std::vector<PairVote> votes = {};                     ///< Ascending by (a, b).
  std::vector<PairPull> pulls =
      {};  ///< Those of limited pairs, once weights are decided. Ascending.

  void add(const TreeSums& other);
};

/// From a robot to its parent, once per round.
struct UpMessage {
  std::uint32_t round = 0;
  TreeSums sums;
  bool failed = false;  ///< The subtree cannot continue.
  /// Reduced right-hand side, 3 or 6 rows per variable.
  Eigen::VectorXd reduced = {};
  /// Empty: as in the round before, except for `weights`.
  std::optional<TreeSystem> system = {};
  std::vector<NewWeight> weights = {};
};

/// Decision of the root on a round.
struct TreeVerdict {
  enum class Next : std::uint8_t {
    kStep,     ///< The new poses are accepted; take the next step times `scale`.
    kShorten,  ///< The new poses are not accepted: take the last step times `scale`.
    kRefresh,  ///< Return to the accepted poses, with new second derivatives.
    kStart,    ///< At the beginning: set the weights and send the equations.
    kCount,    ///< Before kStart: decide the closures inside this robot alone, count again.
    kDone,     ///< The new poses are accepted; this was the last round.
    kStop,     ///< The new poses are not accepted; the accepted ones are the result.
  };
  /// Weights of this round. kWeigh: new ones. kHold: unchanged. kDecided: final.
  enum class Weighing : std::uint8_t { kWeigh, kHold, kDecided };

  std::uint32_t round = 0;  ///< Round to which this is the answer.
  Next next = Next::kStep;
  bool accept = false;  ///< kRefresh: the new poses are accepted.
  bool full = false;    ///< Send full second derivatives from now on.
  /// kCount: defer closures that stand alone. kStart: they remain so. kDone: closures are left for
  /// a second look.
  bool deferred = false;
  bool free = true;  ///< kStart: nothing holds the frame of the team.
  /// kStart, kRefresh: also weigh the closures that robots have decided. kRefresh: the start
  /// poses are the accepted ones again.
  bool weigh_all = false;
  bool restart = false;  ///< kRefresh: the start poses are the accepted ones again.
  Weighing weighing = Weighing::kDecided;
  double scale = 1.0;
  double mu = 0.0;           ///< For the next weights.
  double barc = 0.0;         ///< Largest residual of an inlier [sigma].
  double noise_scale = 1.0;  ///< kDone: at most what the cost of the solution allows.
  /// kStep: first, closures are compared with all other edges, see EdgeWeights::doubt(). All noise
  /// is this many times the claimed one. 0: they are not compared.
  double doubt = 0.0;
  double usual_noise = 1.0;  ///< kStart: see usual_pair_noise().
  /// kCount, kStart: first these robots are moved as a whole, see common_placement(). Ascending.
  std::vector<std::pair<RobotId, SinglePose>> moves = {};
  /// kCount: the odometry of these robots is this many times noisier than it claims. The robots
  /// then only count again. Ascending.
  std::vector<std::pair<RobotId, double>> odometry = {};
  /// kStart: strength of the usual pair of robots, see usual_strength(). While closures are
  /// weighed, no pair is more than 1.25 times as strong. A pair that the other edges contradict
  /// remains limited afterwards.
  Precision usual_pair = kUnlimited;
  /// kRefresh: these pairs, which their pulls do not contradict, are no longer limited. Ascending.
  std::vector<std::pair<RobotId, RobotId>> released = {};
  double cost = 0.0;  ///< Team cost at the accepted poses.
  double gradient = 0.0;
  /// kStep: a rigid motion of all poses that each robot adds to its step, to first order: rotation
  /// and translation, in the frame of the session.
  std::array<double, 6> drift = {};
};

/// From a robot to a child, once per round.
struct DownMessage {
  TreeVerdict verdict;
  /// Step of the variables of the child, in single precision; kStep only.
  Eigen::VectorXd step = {};
  TreeInverse inverse = {};  ///< For the variables of the child; kDone or doubt, empty if unknown.
};

[[nodiscard]] std::vector<std::uint8_t> encode(const UpMessage& message);
[[nodiscard]] std::vector<std::uint8_t> encode(const DownMessage& message);
/// nullopt for anything that encode() does not make, or whose numbers are not finite.
[[nodiscard]] std::optional<UpMessage> decode_up(std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<DownMessage> decode_down(std::span<const std::uint8_t> bytes);
/// True for an UpMessage, by the first byte.
[[nodiscard]] bool is_up_message(std::span<const std::uint8_t> bytes);

}  // namespace km
