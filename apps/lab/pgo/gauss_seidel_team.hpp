#pragma once

#include <map>
#include <vector>

#include "apps/lab/pgo/least_squares_block.hpp"
#include "apps/lab/pgo/team_schedule.hpp"
#include "apps/lab/pgo/team_solver.hpp"

namespace km {

struct GaussSeidelOptions {
  int max_sweeps = 200;  ///< Limit for each of the two stages.
  /// A stage ends when no robot changes by more in a sweep (RMS). The first stage compares the
  /// entries of rotations, the second rotation vectors [rad] and positions [m].
  double tolerance = 1e-4;
};

/// Two-stage distributed Gauss-Seidel (Choudhary et al., "Distributed Mapping with Privacy and
/// Communication Constraints", IJRR 2017). The first stage solves for the rotations of the chordal
/// relaxation. The second stage is one Gauss-Newton step of the whole poses from there. Both stages
/// are linear problems, solved by block Gauss-Seidel sweeps over the robots. In the first sweep of
/// a stage robots follow a tree from robot 0, whose first pose is held. They leave out the edges to
/// robots that have not solved yet (flagged initialisation). In later sweeps robots of one colour
/// solve together. The result is the chordal initialisation improved once, not a minimum. Rank 3.
class GaussSeidelTeam : public TeamSolver {
 public:
  /// `start`: poses of the whole graph. block() uses their translations until the second stage has
  /// computed translations.
  GaussSeidelTeam(const TeamGraph& graph, const std::vector<SE3>& start,
                  const GaussSeidelOptions& options = {});

  /// Throws std::invalid_argument, naming the robot, if its own edges and those to the robots
  /// before it do not determine its poses.
  int step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return robots_[robot].X;
  }

 private:
  struct Robot {
    SessionGraph part;
    std::vector<KeyframeIndex> separators;
    LeastSquaresBlock unknowns;
    std::vector<Eigen::Matrix3d> R;  // after the first stage
    std::map<KeyframeId, Eigen::Matrix3d> R_other;
    LiftedPoses X;
  };
  // Poses that one robot sends to the others.
  struct SentPoses {
    std::vector<KeyframeIndex> keyframes;
    LiftedPoses X;
  };

  void solve(std::size_t k, RoundMeter& meter);
  void send(std::size_t k, RoundMeter& meter);
  void update_poses(Robot& robot) const;
  void receive(Robot& robot, std::size_t peer, const SentPoses& sent) const;
  bool sweep_ended();
  void start_second_stage(RoundMeter& meter);
  [[nodiscard]] LeastSquaresBlock second_stage(std::size_t k) const;

  GaussSeidelOptions options_;
  TeamNeighbours neighbours_;
  TeamTree tree_;
  std::vector<std::vector<std::size_t>> colours_;
  std::vector<Robot> robots_;
  bool poses_stage_ = false;
  bool done_ = false;
  int sweep_ = 0;
  std::size_t turn_ = 0;
};

}  // namespace km
