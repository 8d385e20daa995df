#pragma once

#include "modules/core/config.hpp"
#include "modules/session/pgo_method.hpp"

namespace km {

/// Parameters of the team's pose graph optimisation.
struct PoseGraphConfig {
  static constexpr const char* kSection = "pose_graph";

  PgoMethod method = PgoMethod::kNewton;
  bool robust = true;
  double barc = 0.0;
  bool correct_odometry = true;
  double scale_sigma = 0.003;
  int max_rounds = 0;
  double exchange_budget_kb_s = 20.0;
  double session_growth = 3.0;
  double session_wait_s = 240.0;
  double refinement_period_s = 5.0;

  void visit_fields(auto& visitor) {
    visitor.field("method", method, kPgoMethods,
                  "solver of a session; equal on all robots; measurements are in "
                  "modules/rbcd/README.md");
    visitor.field("robust", robust, "newton: reject closures that other closures contradict");
    visitor.field("barc", barc, {0.0, 1e6},
                  "[sigma] newton: largest residual (square root of the cost) of a closure that is "
                  "kept; equal on all robots; 0: the team estimates it from the closures");
    visitor.field(
        "correct_odometry", correct_odometry,
        "newton, robust: correct a step of odometry if closures inside the robot agree at "
        "three places or more that it is wrong, as after a loss of tracking; false: the "
        "steps stay as measured");
    visitor.field(
        "scale_sigma", scale_sigma, {0.0, 1.0},
        "standard deviation of the scale of the map, which calibration limits: published "
        "covariances contain this share of the distance from the origin of the frame; not "
        "with fixes or a finished map, which determine the scale");
    visitor.field("max_rounds", max_rounds, {0, 1000000},
                  "rounds after which a session ends even if it has not converged; the paper stops "
                  "early after 50; 0: no limit");
    visitor.field("exchange_budget_kb_s", exchange_budget_kb_s, {0.1, 1e6},
                  "[kB/s] mean rate at which a robot may send for sessions, counted per receiver "
                  "and with forwarded messages; the next session waits until the bytes of the "
                  "busiest member in the last one fit this rate");
    visitor.field("session_growth", session_growth, {0.0, 100.0},
                  "relative growth of the number of closures between robots for which the next "
                  "session waits, 3: until there are four times as many; a quarter of it while the "
                  "place of a member is not certain; a new member, or two seconds without new "
                  "measurements, also end the wait");
    visitor.field("session_wait_s", session_wait_s, {0.0, 3600.0},
                  "[s] longest wait for the next session, whatever exchange_budget_kb_s and "
                  "session_growth demand, 0: none; a quarter of it while the place of a member is "
                  "not certain; four times as long while no closure between robots is new");
    visitor.field("refinement_period_s", refinement_period_s, {0.0, 3600.0},
                  "[s] newton: shortest time between refinements of the own poses between "
                  "sessions, by new closures and without a message, in at most a twentieth of the "
                  "time; 0: no refinements");
  }
};

}  // namespace km
