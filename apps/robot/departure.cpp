#include "apps/robot/departure.hpp"

#include <algorithm>

namespace km {

RobotPhase Departure::update(double now_s, const Inputs& inputs) {
  if (inputs.activity != activity_) active_s_ = now_s;
  activity_ = inputs.activity;
  if (!inputs.input_ended) return RobotPhase::kRunning;
  if (!ended_s_) ended_s_ = now_s;

  // Half of the time quiet before saying so: the other half is for the peers to answer.
  const bool settled = inputs.graph_settled && now_s - active_s_ >= 0.5 * settle_s_;
  const bool all_settled =
      settled && std::all_of(inputs.present_peers.begin(), inputs.present_peers.end(),
                             [](RobotPhase phase) { return phase >= RobotPhase::kSettled; });
  if (!all_settled) all_settled_s_.reset();
  if (all_settled && !all_settled_s_) all_settled_s_ = now_s;
  const bool told = std::find(inputs.present_peers.begin(), inputs.present_peers.end(),
                              RobotPhase::kLeaving) != inputs.present_peers.end();
  if (all_settled && (told || now_s - *all_settled_s_ >= settle_s_))
    reason_ = "all present robots have settled";
  else if (now_s - *ended_s_ >= serve_limit_s_)
    reason_ = "time limit for serving peers";
  return settled ? RobotPhase::kSettled : RobotPhase::kFinished;
}

}  // namespace km
