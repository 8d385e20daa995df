#pragma once

#include "modules/core/config.hpp"

namespace km {

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
  double confidence = 0.99;
  double odometry_noise_scale = 1.0;
  double closure_noise_scale = 1.0;
  int min_inliers = 3;

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
    visitor.field("confidence", confidence, {0.01, 1.0 - 1e-12},
                  "probability whose chi-squared quantile with 6 degrees of freedom "
                  "bounds the squared Mahalanobis distance of a consistent cycle (0.99: 16.8)");
    visitor.field("odometry_noise_scale", odometry_noise_scale, {0.01, 1000.0},
                  "factor on the standard deviations of odometry");
    visitor.field("closure_noise_scale", closure_noise_scale, {0.01, 1000.0},
                  "factor on the standard deviations of closures");
    visitor.field("min_inliers", min_inliers, {1, 1000},
                  "pcm: least number of closures in a published set");
  }
};

}  // namespace km
