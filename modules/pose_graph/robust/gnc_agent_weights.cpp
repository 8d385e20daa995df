#include "modules/pose_graph/robust/gnc_agent.hpp"

// How a GncAgent meets its team, and which weight belongs to which edge.

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

// At a start by odometry nothing speaks against odometry. If that may be false, all edges are first
// heard alike.
constexpr int kAllInSteps = 8;

}  // namespace

GncAgent::GncAgent(GncEdges edges, std::set<RobotId> team, int dimension,
                   const GncAgentOptions& options, std::vector<SE3> start, bool common_frame)
    : edges_(std::move(edges)),
      team_(std::move(team)),
      dimension_(dimension),
      options_(options),
      common_frame_(common_frame && !start.empty()),
      block_(edges_.edges, dimension) {
  check(options_.gnc);
  team_.insert(edges_.edges.self);
  bool fits = edges_.own_odometry.size() == edges_.edges.own.size();
  for (const auto& [peer, list] : edges_.edges.to)
    fits = fits && edges_.odometry_to[peer].size() == list.size();
  if (!fits) throw std::invalid_argument("GncAgent: flags and edges differ in number");
  if (!start.empty() && static_cast<Eigen::Index>(start.size()) != edges_.edges.poses)
    throw std::invalid_argument("GncAgent: " + std::to_string(start.size()) + " start poses for " +
                                std::to_string(edges_.edges.poses));
  base_.own = start.empty() ? start_from_odometry(edges_) : std::move(start);
  for (const bool odometry : {false, true}) {
    for (std::size_t k = 0; k < edges_.own_odometry.size(); ++k)
      if (edges_.own_odometry[k] == odometry && (!odometry || options_.reject_odometry))
        inside_.push_back(k);
    if (!odometry) closures_ = inside_.size();
  }
}

GncHello GncAgent::hello() const {
  const RobotId self = edges_.edges.self;
  GncHello hello{.robot = self,
                 .barc = options_.gnc.barc,
                 .poses = block_.public_poses(),
                 .common_frame = common_frame_,
                 .pairs = block_.pairs(),
                 .closures = static_cast<std::uint32_t>(closures_),
                 .residuals = inside_residuals(base_.own)};
  for (const KeyframeIndex k : hello.poses) hello.T_start_pose.push_back(base_.own[k]);
  for (auto to = edges_.edges.to.upper_bound(self); to != edges_.edges.to.end(); ++to)
    for (std::size_t k = 0; k < to->second.size(); ++k) {
      const InterEdge& e = to->second[k];
      hello.links.push_back({.own = e.own,
                             .other = {to->first, e.other},
                             .odometry = edges_.odometry_to.at(to->first)[k],
                             .from_own = e.from_own,
                             .T_from_to = e.T_from_to,
                             .kappa = e.kappa,
                             .tau = e.tau});
    }
  return hello;
}

void GncAgent::meet() {
  for (const auto& [robot, hello] : hellos_)
    if (hello.barc != options_.gnc.barc)
      throw std::invalid_argument("GncAgent: robot " + std::to_string(robot) + " has barc " +
                                  std::to_string(hello.barc) + ", robot " +
                                  std::to_string(edges_.edges.self) + " has " +
                                  std::to_string(options_.gnc.barc));
  graph_ = std::make_shared<const PublicGraph>(hellos_);
  for (const auto& [peer, list] : edges_.edges.to)
    if (graph_->link_count(edges_.edges.self, peer) != list.size())
      throw std::invalid_argument("GncAgent: robots " + std::to_string(edges_.edges.self) +
                                  " and " + std::to_string(peer) + " do not have the same edges");
  system_.emplace(graph_, dimension_);
  const std::map<RobotId, SE3> T_world_start = align_starts(hellos_, *graph_);
  for (SE3& T : base_.own) T = T_world_start.at(edges_.edges.self) * T;
  std::vector<float> inside;
  for (const auto& [robot, hello] : hellos_) {
    for (const SE3& T : hello.T_start_pose) base_.all_public.push_back(T_world_start.at(robot) * T);
    inside.insert(inside.end(), hello.residuals.begin(), hello.residuals.end());
  }
  candidate_ = base_;
  make_schedule();
  link_weights_.assign(graph_->links().size(), 1.0);
  if (options_.reject_odometry)
    all_in_ = kAllInSteps;
  else
    update_weights(inside);
}

void GncAgent::make_schedule() {
  const auto index_of = [&](RobotId robot) {
    return static_cast<RobotId>(std::distance(team_.begin(), team_.find(robot)));
  };
  std::vector<GncCandidate> candidates;
  std::vector<GncCandidate> joined;
  for (const PublicGraph::Link& link : graph_->links()) {
    candidate_of_link_.push_back(link.odometry ? -1 : static_cast<int>(candidates.size()));
    (link.odometry ? joined : candidates).push_back({index_of(link.a), index_of(link.b)});
  }
  for (const auto& [robot, hello] : hellos_) {
    if (robot == edges_.edges.self) first_inside_ = candidates.size();
    for (std::size_t k = 0; k < hello.residuals.size(); ++k)
      candidates.push_back({index_of(robot), index_of(robot), k >= hello.closures});
  }
  schedule_.emplace(std::move(candidates), team_.size(), std::move(joined), options_.gnc,
                    dimension_);
}

std::vector<float> GncAgent::inside_residuals(const std::vector<SE3>& own) const {
  std::vector<float> residuals;
  for (const std::size_t k : inside_)
    residuals.push_back(static_cast<float>(block_.residual(k, own)));
  return residuals;
}

void GncAgent::update_weights(const std::vector<float>& inside) {
  const std::vector<double> between = graph_->residuals(base_.all_public);
  std::vector<float> residuals;
  for (std::size_t k = 0; k < between.size(); ++k)
    if (candidate_of_link_[k] >= 0) residuals.push_back(static_cast<float>(between[k]));
  residuals.insert(residuals.end(), inside.begin(), inside.end());
  (void)schedule_->update(residuals);
  link_weights_.assign(between.size(), 1.0);
  for (std::size_t k = 0; k < between.size(); ++k)
    if (candidate_of_link_[k] >= 0)
      link_weights_[k] = schedule_->weight(static_cast<std::size_t>(candidate_of_link_[k]));
  std::vector<double> own(edges_.edges.own.size(), 1.0);
  for (std::size_t k = 0; k < inside_.size(); ++k)
    own[inside_[k]] = schedule_->weight(first_inside_ + k);
  block_.weigh(own);
}

bool GncAgent::kept_own(std::size_t edge) const {
  const auto found = std::find(inside_.begin(), inside_.end(), edge);
  if (!schedule_ || found == inside_.end()) return true;
  return schedule_->kept(first_inside_ + static_cast<std::size_t>(found - inside_.begin()));
}

bool GncAgent::kept(RobotId peer, std::size_t edge) const {
  if (!schedule_) return true;
  const int k = candidate_of_link_[graph_->link(edges_.edges.self, peer, edge)];
  return k < 0 || schedule_->kept(static_cast<std::size_t>(k));
}

}  // namespace km
