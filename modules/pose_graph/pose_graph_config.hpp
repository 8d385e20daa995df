#pragma once

#include <numbers>

#include "modules/core/config.hpp"
#include "modules/pose_graph/pgo_method.hpp"

namespace km {

/// Parameters of distributed pose graph optimisation. Field names are the YAML keys below
/// `pose_graph:`.
struct PoseGraphConfig {
  static constexpr const char* kSection = "pose_graph";

  /// How a session is solved; the same on all robots. Measured in README.md beside this file.
  PgoMethod method = PgoMethod::kNewton;

  /// Rank r of the relaxation; the same on all robots.
  int rank = 5;

  /// gnc: residual up to which a closure is kept [sigma], the square root of its cost; the same on
  /// all robots. 0: where 99 % of the true ones are, see default_barc().
  double gnc_barc = 0.0;

  /// Rounds (newton, gnc: exchanges) after which a session ends even if it has not converged; 0: no
  /// limit. The paper's early stopping is 50.
  int max_rounds = 0;

  /// newton, gnc: what a robot may send on average [kB/s]. The next session waits until the last
  /// one is paid for.
  double exchange_budget_kb_s = 20.0;

  /// newton, gnc: it also waits until it is worth its bytes: until another robot takes part, the
  /// closures have grown in number by this part of those of the last session, or nothing new has
  /// come for two seconds.
  double session_growth = 1.0;

  /// newton, gnc: but for neither reason longer than this [s].
  double session_wait_s = 60.0;

  /// rbcd: a session has converged when a round lowers the team's cost by less than this part of
  /// it.
  double min_relative_decrease = 1e-7;

  /// rbcd: rounds that a session is given before new keyframes or closures replace it by the next.
  int min_rounds_per_session = 10;

  /// rbcd: Newton steps of one block update, and products with the Hessian in each.
  int max_newton_steps = 3;
  int max_cg_iterations = 50;

  /// rbcd: how far a block update may go at most, the minimum of the block being 1, see
  /// SessionBlock::update(): it grows from 1.5 towards this over the rounds of a session.
  double max_over_relaxation = 1.95;

  /// Closures count as agreeing on where a new robot's frame lies up to this rotation [rad] and
  /// this distance [m]: the drift of the odometry between them.
  double alignment_rotation_rad = 0.3;
  double alignment_translation_m = 10.0;

  /// The trajectory is published at most this often while rounds go on [s].
  double publish_period_s = 1.0;

  /// Status is repeated this often [s]; a session that has not moved for three times as long sends
  /// its last messages again.
  double status_period_s = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field(
        "method", method,
        {{"newton", PgoMethod::kNewton}, {"rbcd", PgoMethod::kRbcd}, {"gnc", PgoMethod::kGnc}},
        "of a session, the same on all robots; gnc: rejects closures");
    visitor.field(
        "gnc_barc", gnc_barc, {0.0, 1e6},
        "[sigma] gnc: largest residual kept, the same on all robots; 0: 99 % of true ones");
    visitor.field("rank", rank, {3, 10}, "rank of the relaxation, the same on all robots");
    visitor.field("max_rounds", max_rounds, {0, 1000000}, "rounds per session, 0: no limit");
    visitor.field("exchange_budget_kb_s", exchange_budget_kb_s, {0.1, 1e6},
                  "[kB/s] newton, gnc: a robot's mean, paid for by waiting between sessions");
    visitor.field("session_growth", session_growth, {0.0, 100.0},
                  "newton, gnc: a session opens when there are so many more closures; 1: twice as many");
    visitor.field("session_wait_s", session_wait_s, {0.0, 3600.0},
                  "[s] newton, gnc: longest wait of what is new for a session");
    visitor.field("min_relative_decrease", min_relative_decrease, {0.0, 0.1},
                  "rbcd: of the team's cost in a round: less is convergence");
    visitor.field("min_rounds_per_session", min_rounds_per_session, {0, 1000},
                  "rbcd: before new measurements open the next session");
    visitor.field("max_newton_steps", max_newton_steps, {1, 100}, "rbcd: per block update");
    visitor.field("max_cg_iterations", max_cg_iterations, {1, 10000}, "rbcd: per Newton step");
    visitor.field("max_over_relaxation", max_over_relaxation, {1.0, 1.99},
                  "rbcd; 1: to the block's minimum");
    visitor.field("alignment_rotation_rad", alignment_rotation_rad, {1e-3, std::numbers::pi},
                  "[rad] agreement of closures on a new robot's frame");
    visitor.field("alignment_translation_m", alignment_translation_m, {1e-3, 1e4}, "[m] the same");
    visitor.field("publish_period_s", publish_period_s, {0.01, 60.0}, "[s] of the trajectory");
    visitor.field("status_period_s", status_period_s, {0.01, 60.0}, "[s] of the optimiser status");
  }
};

}  // namespace km
