#include "modules/pose_graph/robust/public_graph.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/pose_graph/robust/gnc_edges.hpp"

namespace km {
namespace {

[[noreturn]] void refuse(RobotId robot, const std::string& what) {
  throw std::invalid_argument("PublicGraph: robot " + std::to_string(robot) + ' ' + what);
}

bool is_usable(const GncLink& link) {
  return link.T_from_to.matrix().allFinite() && link.kappa > 0.0 && link.tau > 0.0 &&
         std::isfinite(link.kappa) && std::isfinite(link.tau);
}

}  // namespace

PublicGraph::PublicGraph(const GncHellos& hellos) {
  for (const auto& [robot, hello] : hellos) {
    if (hello.poses.empty()) refuse(robot, "has no public pose");
    if (hello.T_start_pose.size() != hello.poses.size())
      refuse(robot, "tells where " + std::to_string(hello.T_start_pose.size()) + " of " +
                        std::to_string(hello.poses.size()) + " public poses start");
    const auto size = static_cast<int>(hello.poses.size());
    first_[robot] = nodes_;
    sizes_[robot] = size;
    for (const auto& [i, j] : hello.pairs) {
      if (i < 0 || j <= i || j >= size) refuse(robot, "couples what is not public");
      pairs_[robot].push_back({nodes_ + i, nodes_ + j});
    }
    pairs_.try_emplace(robot);
    nodes_ += size;
  }
  for (const auto& [robot, hello] : hellos)
    for (const GncLink& link : hello.links) {
      if (link.other.robot <= robot || !hellos.contains(link.other.robot))
        refuse(robot, "has a link to robot " + std::to_string(link.other.robot) +
                          ", which is not in the team or tells it itself");
      if (!is_usable(link)) refuse(robot, "has a link that is not finite with positive precisions");
      const Eigen::Index own = node(hellos, {robot, link.own});
      const Eigen::Index other = node(hellos, link.other);
      links_between_[{robot, link.other.robot}].push_back(links_.size());
      links_.push_back({{link.from_own ? own : other, link.from_own ? other : own, link.T_from_to,
                         link.kappa, link.tau},
                        robot,
                        link.other.robot,
                        link.odometry});
    }
}

Eigen::Index PublicGraph::node(const GncHellos& hellos, const KeyframeId& id) const {
  const std::vector<KeyframeIndex>& poses = hellos.at(id.robot).poses;
  const auto found = std::lower_bound(poses.begin(), poses.end(), id.index);
  if (found == poses.end() || *found != id.index)
    refuse(id.robot, "does not tell its pose " + to_string(id) + ", which a link ends on");
  return first(id.robot) + (found - poses.begin());
}

std::size_t PublicGraph::link(RobotId a, RobotId b, std::size_t k) const {
  return links_between_.at(std::minmax(a, b)).at(k);
}

std::size_t PublicGraph::link_count(RobotId a, RobotId b) const {
  const auto found = links_between_.find(std::minmax(a, b));
  return found == links_between_.end() ? 0 : found->second.size();
}

std::vector<double> PublicGraph::residuals(std::span<const SE3> poses) const {
  std::vector<double> residuals;
  residuals.reserve(links_.size());
  for (const Link& e : links_)
    residuals.push_back(edge_residual(poses[static_cast<std::size_t>(e.i)],
                                      poses[static_cast<std::size_t>(e.j)], e.T_i_j, e.kappa,
                                      e.tau));
  return residuals;
}

}  // namespace km
