#pragma once

#include <numbers>

#include "modules/core/config.hpp"
#include "modules/pose_graph/pgo_method.hpp"

namespace km {

/// Parameters of the team's pose graph optimisation.
struct PoseGraphConfig {
  static constexpr const char* kSection = "pose_graph";

  PgoMethod method = PgoMethod::kNewton;
  bool robust = true;
  double barc = 0.0;
  bool tell_private = false;
  int rank = 5;
  int max_rounds = 0;
  double exchange_budget_kb_s = 20.0;
  double session_growth = 1.0;
  double session_wait_s = 60.0;
  double min_relative_decrease = 1e-7;
  int max_newton_steps = 3;
  int max_cg_iterations = 50;
  double max_over_relaxation = 1.95;
  double alignment_rotation_rad = 0.3;
  double alignment_translation_m = 10.0;
  double publish_period_s = 1.0;
  double status_period_s = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field("method", method, {{"newton", PgoMethod::kNewton}, {"rbcd", PgoMethod::kRbcd}},
                  "of a session, the same on all robots; measured in modules/pose_graph/README.md");
    visitor.field("robust", robust, "newton: rejects closures that the others contradict");
    visitor.field("barc", barc, {0.0, 1e6},
                  "[sigma] newton: largest residual of a closure kept, the square root of its "
                  "cost; the same on all robots; 0: found from the closures");
    visitor.field("tell_private", tell_private,
                  "newton: tells relative poses between private poses where that is fewer bytes: "
                  "others can derive parts of this robot's trajectory");
    visitor.field("rank", rank, {3, 10}, "rbcd: r of the relaxation, the same on all robots");
    visitor.field("max_rounds", max_rounds, {0, 1000000},
                  "after which a session ends even if it has not converged; the paper's early "
                  "stopping is 50; 0: no limit");
    visitor.field(
        "exchange_budget_kb_s", exchange_budget_kb_s, {0.1, 1e6},
        "[kB/s] sent for sessions on average, every reader and what is passed on counted: the next "
        "session waits until the last is paid for by the member that sent most");
    visitor.field("session_growth", session_growth, {0.0, 100.0},
                  "it also waits until another robot takes part, closures have grown in number by "
                  "this part, or nothing new has come for two seconds");
    visitor.field("session_wait_s", session_wait_s, {0.0, 3600.0},
                  "[s] but for neither reason longer than this");
    visitor.field("min_relative_decrease", min_relative_decrease, {0.0, 0.1},
                  "rbcd: of the team's cost in a round: less is convergence");
    visitor.field("max_newton_steps", max_newton_steps, {1, 100}, "rbcd: of one block update");
    visitor.field("max_cg_iterations", max_cg_iterations, {1, 10000},
                  "rbcd: products with the Hessian in a Newton step");
    visitor.field("max_over_relaxation", max_over_relaxation, {1.0, 1.99},
                  "rbcd: how far a block update may go, 1 being the block's minimum; grows from "
                  "1.5 towards this over the rounds of a session");
    visitor.field("alignment_rotation_rad", alignment_rotation_rad, {1e-3, std::numbers::pi},
                  "[rad] closures that differ by less agree on where a new robot's frame lies: the "
                  "drift of the odometry between them");
    visitor.field("alignment_translation_m", alignment_translation_m, {1e-3, 1e4}, "[m] the same");
    visitor.field("publish_period_s", publish_period_s, {0.01, 60.0},
                  "[s] between trajectories at least, while rounds go on");
    visitor.field("status_period_s", status_period_s, {0.01, 60.0},
                  "[s] between the statuses sent to the robots that are heard directly");
  }
};

}  // namespace km
