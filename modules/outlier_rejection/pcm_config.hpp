#pragma once

#include <numbers>

#include "modules/core/config.hpp"
#include "modules/outlier_rejection/clique_method.hpp"

namespace km {

/// Test of a cycle of two closures and the odometry between them.
enum class CycleCriterion {
  kMahalanobis,  ///< Mahalanobis distance of the cycle from the identity, with the covariance along
                 ///< the cycle.
  kBounds,       ///< Fixed bounds on translation and rotation of the cycle.
};

/// Closures of a robot pair that the optimiser receives.
enum class ClosureSelection {
  kWitness,  ///< All, once witnesses agree or the wait for witnesses is over (WitnessedPair).
  kPcm,      ///< The largest set that agrees pairwise (Pcm).
};

/// Parameters of PcmNode, Pcm and WitnessedPair.
struct PcmConfig {
  static constexpr const char* kSection = "pcm";

  ClosureSelection selection = ClosureSelection::kWitness;
  int min_witnesses = 2;
  double witness_wait_s = 30.0;
  int min_lone_support = 150;
  CycleCriterion criterion = CycleCriterion::kMahalanobis;
  double confidence = 0.99;
  double odometry_noise_scale = 1.0;
  double closure_noise_scale = 1.0;
  double max_cycle_translation_m = 0.5;
  double max_cycle_rotation_rad = 0.1;
  bool bounds_per_transform = false;
  bool odometry_gate = false;
  int min_inliers = 3;
  CliqueMethod search = CliqueMethod::kExact;
  int max_search_nodes = 10000;
  double publish_period_s = 0.5;

  void visit_fields(auto& visitor) {
    visitor.field("selection", selection,
                  {{"witness", ClosureSelection::kWitness}, {"pcm", ClosureSelection::kPcm}},
                  "witness: all closures of a pair that is joined, because the optimiser weighs "
                  "them; pcm: the largest set that agrees pairwise");
    visitor.field("min_witnesses", min_witnesses, {1, 1000},
                  "witness: number of closures that join two robots; they must agree pairwise and "
                  "share no neighbourhood");
    visitor.field("witness_wait_s", witness_wait_s, {0.0, 1e6},
                  "[s of keyframe stamps since the first closure] witness: time after which a pair "
                  "is joined without witnesses, tentatively");
    visitor.field(
        "min_lone_support", min_lone_support, {0, 10000},
        "witness: least inliers of a closure and of those beside it that agree, together, "
        "in a pair that is joined without witnesses");
    visitor.field(
        "criterion", criterion,
        {{"mahalanobis", CycleCriterion::kMahalanobis}, {"bounds", CycleCriterion::kBounds}},
        "test of a cycle. mahalanobis: by covariance; bounds: fixed bounds");
    visitor.field("confidence", confidence, {0.01, 1.0 - 1e-12},
                  "mahalanobis: probability whose chi-squared quantile with 6 degrees of freedom "
                  "bounds the squared distance (0.99: 16.8)");
    visitor.field("odometry_noise_scale", odometry_noise_scale, {0.01, 1000.0},
                  "mahalanobis: factor on the standard deviations of odometry");
    visitor.field("closure_noise_scale", closure_noise_scale, {0.01, 1000.0},
                  "mahalanobis: factor on the standard deviations of closures");
    visitor.field("max_cycle_translation_m", max_cycle_translation_m, {1e-6, 1000.0},
                  "[m] bounds: largest translation error of a consistent cycle");
    visitor.field("max_cycle_rotation_rad", max_cycle_rotation_rad, {1e-6, std::numbers::pi},
                  "[rad] bounds: largest rotation error of a consistent cycle");
    visitor.field("bounds_per_transform", bounds_per_transform,
                  "bounds: multiply the bounds by the number of transforms in the cycle");
    visitor.field(
        "odometry_gate", odometry_gate,
        "closures inside one robot must agree with its odometry; not suitable if odometry "
        "jumps, because closures then correct the jump");
    visitor.field("min_inliers", min_inliers, {1, 1000},
                  "pcm: least number of closures in a published set");
    visitor.field(
        "search", search,
        {{"exact", CliqueMethod::kExact},
         {"incremental", CliqueMethod::kIncremental},
         {"batch", CliqueMethod::kBatch}},
        "method for the largest set: exact, or a heuristic of the papers, for comparison");
    visitor.field("max_search_nodes", max_search_nodes, {1, 1000000000},
                  "exact: bound on the search after one closure; beyond it the better result of "
                  "search and heuristic is kept");
    visitor.field("publish_period_s", publish_period_s, {0.01, 60.0},
                  "[s] period at which changed sets are published");
  }
};

}  // namespace km
