#pragma once

#include <numbers>

#include "modules/core/config.hpp"
#include "modules/outlier_rejection/clique_method.hpp"

namespace km {

/// How a cycle of two closures and the odometry between them is judged.
enum class CycleCriterion {
  kMahalanobis,  ///< Its distance from the identity, weighed by the covariance along the cycle.
  kBounds,       ///< Its translation and its rotation against fixed bounds.
};

/// Which closures of a robot pair are handed to the optimiser.
enum class ClosureSelection {
  kWitness,  ///< All, once independent ones agree or the wait for them is over (WitnessedPair).
  kPcm,      ///< The largest set that agrees pairwise (Pcm).
};

/// Parameters of PcmNode, Pcm and WitnessedPair. Field names are the YAML keys below `pcm:`.
struct PcmConfig {
  static constexpr const char* kSection = "pcm";

  /// The optimiser weighs the closures that it is given and rejects false ones. What has to be
  /// decided before is whether two robots are joined at all.
  ClosureSelection selection = ClosureSelection::kWitness;

  /// witness: so many closures that agree pairwise and share no neighbourhood join two robots.
  int min_witnesses = 2;

  /// witness: robots whose closures do not bear each other out so well are joined nevertheless
  /// when so much time has passed since the first closure [s]; it is logged.
  double witness_wait_s = 30.0;

  CycleCriterion criterion = CycleCriterion::kMahalanobis;

  /// Mahalanobis: a cycle is consistent if its squared distance is within this quantile of
  /// chi-squared with 6 degrees of freedom (0.99: 16.8).
  double confidence = 0.99;

  /// Mahalanobis: factors on the standard deviations that odometry and closures come with. Larger
  /// where these are known to be too small: what counts is what the sensors really do.
  double odometry_noise_scale = 1.0;
  double closure_noise_scale = 1.0;

  /// Bounds: largest translation [m] and rotation [rad] of a consistent cycle.
  double max_cycle_translation_m = 0.5;
  double max_cycle_rotation_rad = 0.1;

  /// Bounds: true multiplies them by the number of transforms in the cycle.
  bool bounds_per_transform = false;

  /// Closures inside one robot must agree with that robot's odometry alone. Wrong where odometry
  /// jumps: such a closure is the correction.
  bool odometry_gate = false;

  /// pcm: a smaller consistent set is not trusted and not published.
  int min_inliers = 3;

  /// How the largest set is searched. The heuristics are those of the papers, for comparison.
  CliqueMethod search = CliqueMethod::kExact;

  /// Exact: bound on the search tree after one closure; beyond it the better of what the tree and
  /// the heuristic found is kept.
  int max_search_nodes = 10000;

  /// Sets that changed are published together this often [s]: while closures pour in, not every
  /// intermediate set has to travel.
  double publish_period_s = 0.5;

  void visit_fields(auto& visitor) {
    visitor.field("selection", selection,
                  {{"witness", ClosureSelection::kWitness}, {"pcm", ClosureSelection::kPcm}},
                  "witness: all of a pair that is joined; pcm: the largest set that agrees");
    visitor.field("min_witnesses", min_witnesses, {1, 1000},
                  "witness: independent closures that agree");
    visitor.field("witness_wait_s", witness_wait_s, {0.0, 1e6},
                  "[s] witness: then a pair is joined without");
    visitor.field(
        "criterion", criterion,
        {{"mahalanobis", CycleCriterion::kMahalanobis}, {"bounds", CycleCriterion::kBounds}},
        "mahalanobis: by covariance; bounds: fixed");
    visitor.field("confidence", confidence, {0.01, 1.0 - 1e-12}, "chi-squared, 6 dof");
    visitor.field("odometry_noise_scale", odometry_noise_scale, {0.01, 1000.0},
                  "on standard deviations");
    visitor.field("closure_noise_scale", closure_noise_scale, {0.01, 1000.0},
                  "on standard deviations");
    visitor.field("max_cycle_translation_m", max_cycle_translation_m, {1e-6, 1000.0}, "[m]");
    visitor.field("max_cycle_rotation_rad", max_cycle_rotation_rad, {1e-6, std::numbers::pi},
                  "[rad]");
    visitor.field("bounds_per_transform", bounds_per_transform, "times transforms in the cycle");
    visitor.field("odometry_gate", odometry_gate, "closures inside one robot against its odometry");
    visitor.field("min_inliers", min_inliers, {1, 1000}, "pcm: smaller sets are not trusted");
    visitor.field("search", search,
                  {{"exact", CliqueMethod::kExact},
                   {"incremental", CliqueMethod::kIncremental},
                   {"batch", CliqueMethod::kBatch}},
                  "largest set: exact, or a heuristic");
    visitor.field("max_search_nodes", max_search_nodes, {1, 1000000000}, "exact: per closure");
    visitor.field("publish_period_s", publish_period_s, {0.01, 60.0}, "[s] of changed sets");
  }
};

}  // namespace km
