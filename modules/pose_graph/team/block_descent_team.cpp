#include "modules/pose_graph/team/block_descent_team.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "modules/pose_graph/team/team_schedule.hpp"

namespace km {

BlockDescentTeam::BlockDescentTeam(const TeamGraph& graph, const LiftedPoses& start,
                                   const BlockDescentOptions& options)
    : options_(options), colours_(colours_of(neighbours_in(graph))) {
  if (options.accelerated && options.schedule == BlockSchedule::kGreedy)
    throw std::invalid_argument("BlockDescentTeam: acceleration takes the coloured schedule");
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    const RobotPart part = part_of(graph, k);
    const LiftedPoses X = start.middleCols(4 * graph.first[k], 4 * part.poses);
    Robot robot{.block = SessionBlock(X, part.own_edges, part.edges_to, part.verticals),
                .neighbours = {},
                .earlier = {},
                .gradient_norm = 0.0,
                .cost = 0.0,
                .X = {},
                .V = {},
                .heard = {}};
    for (const auto& [peer, edges] : part.edges_to) {
      robot.neighbours.push_back(peer);
      if (peer < k) robot.earlier.insert(peer);
    }
    robots_.push_back(std::move(robot));
  }
}

PublicPoses BlockDescentTeam::message_of(std::size_t k, LiftedPoses X) const {
  PublicPoses poses{.sender = {.robot = static_cast<RobotId>(k)}, .round = round_};
  poses.cost = robots_[k].cost;
  poses.squared_gradient = robots_[k].gradient_norm * robots_[k].gradient_norm;
  poses.keyframes = robots_[k].block.public_keyframes();
  poses.X = std::move(X);
  return poses;
}

void BlockDescentTeam::tell(std::size_t k, RoundMeter& meter) {
  const PublicPoses poses =
      meter.run(k, [&] { return message_of(k, robots_[k].block.round_public_poses()); });
  meter.sent(poses);
  for (const std::size_t peer : robots_[k].neighbours)
    meter.run(peer, [&] {
      (void)robots_[peer].block.set_neighbour(static_cast<RobotId>(k), poses.keyframes,
                                              restore_stiefel(poses.X));
    });
}

bool BlockDescentTeam::step(RoundMeter& meter) {
  if (round_++ == 0) {
    open(meter);
  } else if (options_.accelerated) {
    step_accelerated(meter);
  } else if (options_.schedule == BlockSchedule::kGreedy) {
    step_greedy(meter);
  } else {
    step_coloured(meter);
  }
  return true;
}

void BlockDescentTeam::open(RoundMeter& meter) {
  std::vector<std::size_t> all(robots_.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  if (options_.accelerated)
    for (const std::size_t k : all) {
      robots_[k].X = robots_[k].V = robots_[k].block.X();
      tell_accelerated(k, meter);
    }
  else
    for (const std::size_t k : all) tell(k, meter);
  if (options_.schedule == BlockSchedule::kGreedy) tell_gradients(all, meter);
}

void BlockDescentTeam::tell_gradients(const std::vector<std::size_t>& robots, RoundMeter& meter) {
  for (const std::size_t k : robots) {
    Robot& robot = robots_[k];
    robot.gradient_norm = meter.run(k, [&] { return robot.block.gradient_norm(); });
    PublicPoses scalar = message_of(k, LiftedPoses(robot.block.X().rows(), 0));
    scalar.keyframes.clear();
    meter.sent(scalar);
  }
}

void BlockDescentTeam::step_greedy(RoundMeter& meter) {
  const auto largest = std::max_element(
      robots_.begin(), robots_.end(),
      [](const Robot& a, const Robot& b) { return a.gradient_norm < b.gradient_norm; });
  const auto k = static_cast<std::size_t>(largest - robots_.begin());
  meter.run(k, [&] { (void)robots_[k].block.update(options_.block_update, 1.0); });
  tell(k, meter);
  std::vector<std::size_t> affected = robots_[k].neighbours;
  affected.push_back(k);
  tell_gradients(affected, meter);
}

void BlockDescentTeam::step_coloured(RoundMeter& meter) {
  const double relaxation =
      robots_.size() == 1 ? 1.0 : growing_relaxation(sweep_, options_.max_over_relaxation);
  for (const std::size_t k : colours_[turn_])
    meter.run(k, [&] { (void)robots_[k].block.update(options_.block_update, relaxation); });
  for (const std::size_t k : colours_[turn_]) tell(k, meter);
  turn_ = (turn_ + 1) % colours_.size();
  if (turn_ == 0) ++sweep_;
}

}  // namespace km
