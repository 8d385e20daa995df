#pragma once

#include <optional>
#include <vector>

#include "modules/pose_graph/robust/gnc_team.hpp"

namespace km {

/// GncAgents of a whole team in one process, in two stages where many closures are isolated (see
/// isolated_closures()), or few but costly ones: these first stand aside, so that random false ones
/// neither pull at the poses nor couple everything with everything. Those whose residual at the
/// result is not far from that of an inlier come back in, and the team decides once more from
/// there. Which closures are isolated their two robots can tell from the edges and odometry that
/// they know of each other; for the residuals every robot tells where the poses at their ends are,
/// which counts as a round.
class StagedGncTeam : public TeamSolver {
 public:
  /// Throws as GncTeam does.
  StagedGncTeam(const TeamGraph& graph, Eigen::Index rank, const GncAgentOptions& options);

  bool step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return team_->block(robot);
  }
  [[nodiscard]] const GncAgent& agent(std::size_t robot) const { return team_->agent(robot); }
  /// Which edges of the graph are inliers.
  [[nodiscard]] std::vector<bool> kept() const;
  /// Updates of the weights so far, in both stages.
  [[nodiscard]] int updates() const;
  [[nodiscard]] bool done() const { return team_->agent(0).done() && !aside_; }
  /// How many closures stood aside at first.
  [[nodiscard]] std::size_t isolated() const { return isolated_; }

 private:
  [[nodiscard]] TeamGraph part() const;
  void set_aside(double barc);
  void tell_ends(RoundMeter& meter) const;
  void bring_back(RoundMeter& meter);

  TeamGraph graph_;
  Eigen::Index rank_;
  GncAgentOptions options_;
  std::vector<bool> taking_part_;  // edges of the present stage
  std::size_t isolated_ = 0;
  bool aside_ = false;  // some edges still are
  int updates_before_ = 0;
  std::optional<GncTeam> team_;
};

}  // namespace km
