#include "modules/pgo_study/block_descent_team.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "modules/pgo_study/message_sizes.hpp"
#include "modules/pgo_study/team_schedule.hpp"

namespace km {
namespace {

// Told with the poses: the robot's part of cost and squared gradient, by which the team ends.
constexpr std::size_t kShare = bytes_of_doubles(2);

}  // namespace

BlockDescentTeam::BlockDescentTeam(const TeamGraph& graph, const LiftedPoses& start,
                                   const BlockDescentOptions& options)
    : options_(options), colours_(colours_of(neighbours_in(graph))) {
  if (options.accelerated && options.schedule == BlockSchedule::kGreedy)
    throw std::invalid_argument("BlockDescentTeam: acceleration takes the coloured schedule");
  const TeamNeighbours neighbours = neighbours_in(graph);
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    const SessionGraph part = part_of(graph, k);
    const LiftedPoses X = start.middleCols(4 * graph.first[k], 4 * graph.poses_of(k));
    Robot robot{.block = DescentBlock(part, X),
                .neighbours = neighbours[k],
                .earlier = {},
                .gradient_norm = 0.0,
                .cost = 0.0,
                .X = {},
                .V = {},
                .heard = {}};
    for (const std::size_t peer : robot.neighbours)
      if (peer < k) robot.earlier.insert(static_cast<RobotId>(peer));
    robots_.push_back(std::move(robot));
  }
}

void BlockDescentTeam::tell(std::size_t k, RoundMeter& meter) {
  const ToldBlock poses = meter.run(k, [&] { return robots_[k].block.round_public_poses(); });
  meter.sent(kMessageHeader + bytes_of_poses(poses.keyframes.size(), poses.X.rows()) + kShare);
  for (const std::size_t peer : robots_[k].neighbours)
    meter.run(peer,
              [&] { (void)robots_[peer].block.set_neighbour(static_cast<RobotId>(k), poses); });
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
    meter.sent(kMessageHeader + bytes_of_doubles(1));
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
