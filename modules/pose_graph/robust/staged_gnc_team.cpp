#include "modules/pose_graph/robust/staged_gnc_team.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/newton/elimination_plan.hpp"
#include "modules/pose_graph/robust/isolated_closures.hpp"
#include "modules/pose_graph/robust/noise_scale.hpp"

namespace km {
namespace {

// So few do no harm.
constexpr std::size_t kFewIsolated = 32;
// With fewer closures left per pose, the others are needed from the start.
constexpr double kClosuresPerPose = 0.25;
// Where most closures have others beside them, the few that do not have no cause to be false, and
// the team does better to hear all at once: unless they are so many of all closures, or make so
// much more work to eliminate the poses, if that is more than a few milliseconds.
constexpr double kManyIsolated = 0.2;
constexpr double kMuchMoreWork = 3.0;
constexpr double kLittleWork = 3e5;  // multiplications of blocks
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

// Of a Cholesky factorisation of all poses' system, in multiplications of blocks. Who eliminates
// which pose changes it little, and closures between far ends cost everyone.
double elimination_work(const TeamGraph& graph, const std::vector<bool>& taking_part) {
  std::set<NodePair> pairs;
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    const auto [i, j] = std::minmax(graph.edges[k].i, graph.edges[k].j);
    if (taking_part[k]) pairs.insert({static_cast<int>(i), static_cast<int>(j)});
  }
  const EliminationPlan plan(std::vector<bool>(static_cast<std::size_t>(graph.poses()), false),
                             {pairs.begin(), pairs.end()});
  double work = 0.0;
  for (const EliminationPlan::Front& front : plan.fronts()) {
    const auto size = static_cast<double>(front.nodes.size());
    work += size * size * static_cast<double>(front.pivots);
  }
  return work;
}

bool do_harm(const TeamGraph& graph, const std::vector<bool>& taking_part, std::size_t isolated,
             std::size_t closures) {
  if (isolated <= kFewIsolated) return false;
  if (static_cast<double>(isolated) >= kManyIsolated * static_cast<double>(closures)) return true;
  const std::vector<bool> all(graph.edges.size(), true);
  const double work = elimination_work(graph, all);
  return work > kLittleWork && work > kMuchMoreWork * elimination_work(graph, taking_part);
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
  // Where closures are much better than the graph says, so must their neighbours agree.
  const std::optional<NoiseScale> noise = noise_scale(graph_, odometry);
  const double agreement = barc * std::min(1.0, noise ? noise->scale : 1.0);
  std::vector<bool> corroborated = isolated_closures(graph_, odometry, agreement);
  corroborated.flip();
  const auto closures =
      static_cast<std::size_t>(std::count(odometry.begin(), odometry.end(), false));
  const auto isolated =
      static_cast<std::size_t>(std::count(corroborated.begin(), corroborated.end(), false));
  if (!do_harm(graph_, corroborated, isolated, closures) || !joins_all(graph_, corroborated) ||
      static_cast<double>(closures - isolated) <
          kClosuresPerPose * static_cast<double>(graph_.poses()))
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
  const double barc = team_->agent(0).schedule()->barc();
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
