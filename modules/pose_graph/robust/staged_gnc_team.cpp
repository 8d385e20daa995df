#include "modules/pose_graph/robust/staged_gnc_team.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/robust/isolated_closures.hpp"

namespace km {
namespace {

// So few do no harm.
constexpr std::size_t kFewIsolated = 32;
// With fewer closures left per pose, the others are needed from the start.
constexpr double kClosuresPerPose = 0.25;
// Of all closures, from here on: where most have others beside them, the few that do not have no
// cause to be false, and the team does better to hear all at once.
constexpr double kManyIsolated = 0.2;
// Of barc: what comes back in may lie so far off poses that were found without it.
constexpr double kSecondChance = 3.0;

bool joins_all(const TeamGraph& graph, const std::vector<bool>& taking_part) {
  std::vector<std::size_t> part(graph.robots());
  for (std::size_t k = 0; k < part.size(); ++k) part[k] = k;
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    if (!taking_part[k]) continue;
    const std::size_t a = part[graph.robot_of(graph.edges[k].i)];
    const std::size_t b = part[graph.robot_of(graph.edges[k].j)];
    std::replace(part.begin(), part.end(), b, a);
  }
  return std::all_of(part.begin(), part.end(), [&](std::size_t p) { return p == part[0]; });
}

}  // namespace

StagedGncTeam::StagedGncTeam(const TeamGraph& graph, Eigen::Index rank,
                             const GncAgentOptions& options)
    : graph_(graph), rank_(rank), options_(options), taking_part_(graph.edges.size(), true) {
  check(options.gnc);
  set_aside(options.gnc.barc > 0.0 ? options.gnc.barc : default_barc(graph.dimension));
  team_.emplace(part(), rank, LiftedPoses{}, options);
}

void StagedGncTeam::set_aside(double barc) {
  const std::vector<bool> odometry = odometry_edges(graph_);
  std::vector<bool> corroborated = isolated_closures(graph_, odometry, barc);
  corroborated.flip();
  const auto steps = std::count(odometry.begin(), odometry.end(), true);
  const auto left = std::count(corroborated.begin(), corroborated.end(), true) - steps;
  const std::size_t isolated = graph_.edges.size() - static_cast<std::size_t>(left + steps);
  const double closures = static_cast<double>(graph_.edges.size()) - static_cast<double>(steps);
  if (isolated <= kFewIsolated || static_cast<double>(isolated) < kManyIsolated * closures ||
      !joins_all(graph_, corroborated) ||
      static_cast<double>(left) < kClosuresPerPose * static_cast<double>(graph_.poses()))
    return;
  taking_part_ = std::move(corroborated);
  isolated_ = isolated;
  aside_ = true;
}

TeamGraph StagedGncTeam::part() const {
  TeamGraph part = graph_;
  part.edges.clear();
  for (std::size_t k = 0; k < graph_.edges.size(); ++k)
    if (taking_part_[k]) part.edges.push_back(graph_.edges[k]);
  return part;
}

bool StagedGncTeam::step(RoundMeter& meter) {
  if (team_->step(meter)) return true;
  if (!aside_ || !team_->agent(0).done()) return false;
  bring_back(meter);
  aside_ = false;
  return true;
}

void StagedGncTeam::bring_back(RoundMeter& meter) {
  tell_ends(meter);
  const double barc = team_->agent(0).schedule()->barc() * team_->agent(0).schedule()->scale();
  std::vector<bool> next = kept();
  bool any = false;
  for (std::size_t k = 0; k < next.size(); ++k) {
    if (taking_part_[k]) continue;
    const BlockEdge& e = graph_.edges[k];
    const auto pose = [&](Eigen::Index i) {
      const std::size_t robot = graph_.robot_of(i);
      return agent(robot).poses()[static_cast<std::size_t>(i - graph_.first[robot])];
    };
    next[k] = edge_residual(pose(e.i), pose(e.j), e.T_i_j, e.kappa, e.tau) <= kSecondChance * barc;
    any = any || next[k];
  }
  if (!any || !joins_all(graph_, next)) return;
  std::vector<SE3> poses;
  for (std::size_t k = 0; k < graph_.robots(); ++k)
    poses.insert(poses.end(), agent(k).poses().begin(), agent(k).poses().end());
  updates_before_ = updates();
  taking_part_ = std::move(next);
  team_.emplace(part(), rank_, lift(poses, rank_), options_);
}

void StagedGncTeam::tell_ends(RoundMeter& meter) const {
  std::map<std::size_t, std::set<KeyframeIndex>> ends;
  for (std::size_t k = 0; k < graph_.edges.size(); ++k) {
    const std::size_t a = graph_.robot_of(graph_.edges[k].i);
    const std::size_t b = graph_.robot_of(graph_.edges[k].j);
    if (taking_part_[k] || a == b) continue;
    ends[a].insert(static_cast<KeyframeIndex>(graph_.edges[k].i - graph_.first[a]));
    ends[b].insert(static_cast<KeyframeIndex>(graph_.edges[k].j - graph_.first[b]));
  }
  for (const auto& [robot, poses] : ends) {
    GncHello told{.robot = static_cast<RobotId>(robot), .poses = {poses.begin(), poses.end()}};
    for (const KeyframeIndex i : told.poses) told.T_start_pose.push_back(agent(robot).poses()[i]);
    meter.sent(told);
  }
}

std::vector<bool> StagedGncTeam::kept() const {
  const std::vector<bool> of_part = team_->kept();
  std::vector<bool> kept(graph_.edges.size(), false);
  std::size_t next = 0;
  for (std::size_t k = 0; k < kept.size(); ++k)
    if (taking_part_[k]) kept[k] = of_part[next++];
  return kept;
}

int StagedGncTeam::updates() const {
  const auto& schedule = team_->agent(0).schedule();
  return updates_before_ + (schedule ? schedule->updates() : 0);
}

}  // namespace km
