#include <Eigen/Eigenvalues>
#include <cmath>

#include "modules/pgo_study/block_descent_team.hpp"
#include "modules/pgo_study/message_sizes.hpp"

namespace km {
namespace {

// The feasible poses nearest to `M`: the polar factor of every rotation.
LiftedPoses project(LiftedPoses M) {
  for (Eigen::Index i = 0; i < pose_count(M); ++i) {
    auto Y = M.middleCols<3>(4 * i);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(Eigen::Matrix3d(Y.transpose() * Y));
    Y = (Y * eigen.operatorInverseSqrt()).eval();
  }
  return M;
}

LiftedPoses mix(const LiftedPoses& X, const LiftedPoses& V, double alpha) {
  return project((1.0 - alpha) * X + alpha * V);
}

// The robot's part of the cost, and momentum beside every pose.
std::size_t bytes_of(std::size_t poses, Eigen::Index rank) {
  return kMessageHeader + 2 * bytes_of_poses(poses, rank) + bytes_of_doubles(1);
}

}  // namespace

void BlockDescentTeam::tell_accelerated(std::size_t k, RoundMeter& meter) {
  Robot& robot = robots_[k];
  const auto& keyframes = robot.block.public_keyframes();
  const Heard told = meter.run(k, [&] {
    if (round_ > 1) robot.cost = robot.block.share_of_cost(robot.earlier);
    return Heard{k,
                 {keyframes, round_poses(robot.X, keyframes)},
                 {keyframes, round_poses(robot.V, keyframes)}};
  });
  robot.block.move_to(robot.X);
  meter.sent(bytes_of(keyframes.size(), robot.X.rows()));
  for (const std::size_t peer : robot.neighbours) {
    auto& heard = robots_[peer].heard;
    const auto known = std::find_if(heard.begin(), heard.end(),
                                    [&](const Heard& other) { return other.robot == k; });
    meter.run(peer, [&] {
      if (known == heard.end())
        heard.push_back(told);
      else
        *known = told;
    });
  }
}

// Y = Proj((1 - alpha) X + alpha V) at every robot, for its own poses and for those it has heard:
// nothing has to be told. X of the robots that do not update is Y from now on.
void BlockDescentTeam::mix_all(double alpha, RoundMeter& meter) {
  for (std::size_t k = 0; k < robots_.size(); ++k)
    meter.run(k, [&] {
      Robot& robot = robots_[k];
      robot.X = mix(robot.X, robot.V, alpha);
      robot.block.move_to(robot.X);
      for (Heard& heard : robot.heard) {
        heard.X.X = mix(heard.X.X, heard.V.X, alpha);
        (void)robot.block.set_neighbour(static_cast<RobotId>(heard.robot), heard.X);
      }
    });
}

void BlockDescentTeam::step_accelerated(RoundMeter& meter) {
  if (turn_ == 0) restart_if_risen(meter);
  const auto N = static_cast<double>(colours_.size());
  gamma_ = (1.0 + std::sqrt(1.0 + 4.0 * N * N * gamma_ * gamma_)) / (2.0 * N);
  mix_all(1.0 / (gamma_ * N), meter);
  for (const std::size_t k : colours_[turn_])
    meter.run(k, [&] {
      Robot& robot = robots_[k];
      const LiftedPoses Y = robot.X;
      (void)robot.block.update(options_.block_update, 1.0);
      robot.X = robot.block.X();
      robot.V = project(robot.V + gamma_ * (robot.X - Y));
    });
  for (const std::size_t k : colours_[turn_]) tell_accelerated(k, meter);
  turn_ = (turn_ + 1) % colours_.size();
}

// The team's cost is the sum of the shares told in the last sweep. Without momentum V = X.
void BlockDescentTeam::restart_if_risen(RoundMeter& meter) {
  double cost = 0.0;
  for (const Robot& robot : robots_) cost += robot.cost;
  const bool risen = last_cost_ > 0.0 && cost > last_cost_;
  last_cost_ = cost;
  if (!risen) return;
  gamma_ = 0.0;
  for (std::size_t k = 0; k < robots_.size(); ++k)
    meter.run(k, [&] {
      robots_[k].V = robots_[k].X;
      for (Heard& heard : robots_[k].heard) heard.V.X = heard.X.X;
    });
}

}  // namespace km
