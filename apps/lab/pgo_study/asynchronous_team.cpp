#include "apps/lab/pgo_study/asynchronous_team.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "apps/lab/pgo_study/message_sizes.hpp"

namespace km {
namespace {

// Proximal weight that outweighs missed and concurrent changes of neighbours; see the class
// comment.
double weight_for(int max_delay) {
  constexpr double kSurplus = 1.01;
  return kSurplus * (1.0 + 2.0 * max_delay);
}

const AsynchronousOptions& checked(const AsynchronousOptions& options) {
  if (options.max_delay < 0)
    throw std::invalid_argument("AsynchronousTeam: max_delay " + std::to_string(options.max_delay) +
                                " is negative");
  if (!(options.loss >= 0.0 && options.loss < 1.0))
    throw std::invalid_argument("AsynchronousTeam: loss " + std::to_string(options.loss) +
                                " is not in [0, 1)");
  return options;
}

}  // namespace

AsynchronousTeam::AsynchronousTeam(const TeamGraph& graph, const LiftedPoses& start,
                                   const AsynchronousOptions& options)
    : options_(checked(options)), rng_(options.seed) {
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    const SessionGraph part = part_of(graph, k);
    const LiftedPoses X = start.middleCols(4 * graph.first[k], 4 * graph.poses_of(k));
    Robot robot{.block = ProximalBlock(part, X, weight_for(options.max_delay)), .received = {}};
    for (const PoseEdge& e : part.between) robot.received.emplace(e.other(part.self).robot, 0);
    robots_.push_back(std::move(robot));
  }
}

int AsynchronousTeam::step(RoundMeter& meter) {
  ++round_;
  deliver(meter);
  const double relaxation =
      relaxation_after(static_cast<std::uint32_t>(round_) - 1, options_.max_over_relaxation);
  for (std::size_t k = 0; k < robots_.size(); ++k) {
    if (!may_move(robots_[k])) continue;
    meter.run(k, [&] { (void)robots_[k].block.update(options_.block_update, relaxation); });
    ++updates_;
  }
  for (std::size_t k = 0; k < robots_.size(); ++k) send(k, meter);
  return 1;
}

// Poses that arrive after newer ones of the same neighbour are dropped.
void AsynchronousTeam::deliver(RoundMeter& meter) {
  for (const Message& message : messages_) {
    if (message.due > round_) continue;
    Robot& receiver = robots_[message.receiver];
    int& received = receiver.received.at(message.sender);
    if (message.round <= received) continue;
    received = message.round;
    meter.run(message.receiver,
              [&] { (void)receiver.block.set_neighbour(message.sender, message.poses); });
  }
  std::erase_if(messages_, [&](const Message& message) { return message.due <= round_; });
}

// Poses sent in the previous round miss no update. No robot moves in round 1, even one without
// neighbours.
bool AsynchronousTeam::may_move(const Robot& robot) const {
  return round_ > 1 &&
         std::all_of(robot.received.begin(), robot.received.end(), [&](const auto& entry) {
           return entry.second > 0 && round_ - 1 - entry.second <= options_.max_delay;
         });
}

// A robot that has not moved sends its poses too, because its last message may be lost.
void AsynchronousTeam::send(std::size_t k, RoundMeter& meter) {
  Robot& robot = robots_[k];
  const SentPoses poses = meter.run(k, [&] { return robot.block.round_public_poses(); });
  meter.sent(kMessageHeader + bytes_of_poses(poses.keyframes.size(), poses.X.rows()));
  for (const auto& [peer, received] : robot.received) {
    const bool lost = std::bernoulli_distribution(options_.loss)(rng_);
    const int delay = std::uniform_int_distribution(0, options_.max_delay)(rng_);
    if (!lost)
      messages_.push_back({round_ + 1 + delay, round_, static_cast<RobotId>(k), peer, poses});
  }
}

}  // namespace km
