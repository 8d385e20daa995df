#pragma once

#include <numbers>

#include "modules/core/config.hpp"
#include "modules/pose_graph/pgo_method.hpp"

namespace km {

/// Parameters of the team's pose graph optimisation. Field names are the YAML keys below
/// `pose_graph:`.
struct PoseGraphConfig {
  static constexpr const char* kSection = "pose_graph";

  /// How a session is solved; the same on all robots. Measured in README.md beside this file.
  PgoMethod method = PgoMethod::kNewton;

  /// newton: closures that the others contradict are rejected.
  bool robust = true;

  /// newton: residual up to which a closure is kept [sigma], the square root of its cost; the same
  /// on all robots. 0: found from the closures.
  double barc = 0.0;

  /// newton: tells relative poses between private poses where that is fewer bytes: others can
  /// derive parts of this robot's trajectory from them.
  bool tell_private = false;

  /// rbcd: rank r of the relaxation; the same on all robots.
  int rank = 5;

  /// Rounds after which a session ends even if it has not converged; 0: no limit. The paper's early
  /// stopping is 50.
  int max_rounds = 0;

  /// What a robot may send for sessions on average [kB/s], every reader counted and what it passes
  /// on for others. The next session waits until the last one is paid for by the member that has
  /// sent most.
  double exchange_budget_kb_s = 20.0;

  /// It also waits until it is worth its bytes: until another robot takes part, the closures have
  /// grown in number by this part of those of the last session, or nothing new has come for two
  /// seconds.
  double session_growth = 1.0;

  /// But for neither reason longer than this [s].
  double session_wait_s = 60.0;

  /// rbcd: a session has converged when a round lowers the team's cost by less than this part of
  /// it.
  double min_relative_decrease = 1e-7;

  /// rbcd: Newton steps of one block update, and products with the Hessian in each.
  int max_newton_steps = 3;
  int max_cg_iterations = 50;

  /// rbcd: how far a block update may go at most, the minimum of the block being 1: it grows from
  /// 1.5 towards this over the rounds of a session.
  double max_over_relaxation = 1.95;

  /// Closures count as agreeing on where a new robot's frame lies up to this rotation [rad] and
  /// this distance [m]: the drift of the odometry between them.
  double alignment_rotation_rad = 0.3;
  double alignment_translation_m = 10.0;

  /// The trajectory is published at most this often while rounds go on [s].
  double publish_period_s = 1.0;

  /// Status is repeated this often to the robots that are heard directly [s].
  double status_period_s = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field("method", method, {{"newton", PgoMethod::kNewton}, {"rbcd", PgoMethod::kRbcd}},
                  "of a session, the same on all robots");
    visitor.field("robust", robust, "newton: rejects closures that the others contradict");
    visitor.field("barc", barc, {0.0, 1e6},
                  "[sigma] newton: largest residual kept, the same on all robots; 0: found");
    visitor.field("tell_private", tell_private,
                  "newton: fewer bytes, and others can derive private poses");
    visitor.field("rank", rank, {3, 10}, "rbcd: of the relaxation, the same on all robots");
    visitor.field("max_rounds", max_rounds, {0, 1000000}, "rounds per session, 0: no limit");
    visitor.field("exchange_budget_kb_s", exchange_budget_kb_s, {0.1, 1e6},
                  "[kB/s] a robot's mean, paid for by waiting between sessions");
    visitor.field("session_growth", session_growth, {0.0, 100.0},
                  "a session opens when there are so many more closures; 1: twice as many");
    visitor.field("session_wait_s", session_wait_s, {0.0, 3600.0},
                  "[s] longest wait of what is new for a session");
    visitor.field("min_relative_decrease", min_relative_decrease, {0.0, 0.1},
                  "rbcd: of the team's cost in a round: less is convergence");
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
