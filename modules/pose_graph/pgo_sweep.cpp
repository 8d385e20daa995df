#include "modules/pose_graph/pgo_agent.hpp"

// Block-coordinate descent.

namespace km {

void PgoAgent::sweep(PgoOutput& output) {
  const PgoSession& session = running_->session;
  const bool stopped = session.max_rounds > 0 && *running_->round >= session.max_rounds;
  if (stopped || !hear_neighbours()) return repeat_if_silent(output);
  const TruncatedNewtonOptions options{.max_iterations = config_.max_newton_steps,
                                       .max_cg_iterations = config_.max_cg_iterations};
  const double relaxation = relaxation_of(*running_->round, session.plan.members.size());
  const auto result = block_->update(options, relaxation);
  ++*running_->round;
  ++total_rounds_;
  LiftedPoses rounded = block_->round_public_poses();
  const double cost = block_->share_of_cost(running_->counted);
  send_poses(std::move(rounded), cost, result.initial_gradient_norm * result.initial_gradient_norm,
             output);
}

double PgoAgent::relaxation_of(std::uint32_t round, std::size_t members) const {
  if (members == 1) return 1.0;
  return growing_relaxation(round, config_.max_over_relaxation);
}

void PgoAgent::count_share(const PublicPoses& poses) {
  if (!ledger_ || poses.session != running_->session.id || poses.round == 0) return;
  if (!ledger_->record(poses.sender.robot, poses.round, poses.cost, poses.squared_gradient)) return;
  PgoSession& session = running_->session;
  if (running_->exchange) {  // all have adopted the solution
    session.finished = announce_session_ = true;
    const auto pose = world_of(session.anchor);
    if (pose && session.anchor_pose.size() == 0) session.anchor_pose = *pose;
    return;
  }
  session.round = ledger_->last()->round;
  session.cost = ledger_->last()->cost;
  session.gradient_norm = ledger_->last()->gradient_norm;
  const auto decrease = ledger_->relative_decrease();
  session.finished = (session.max_rounds > 0 && session.round >= session.max_rounds) ||
                     (decrease && *decrease < config_.min_relative_decrease);
  announce_session_ |= session.finished;
}

}  // namespace km
