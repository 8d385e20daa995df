#include <algorithm>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "modules/pose_graph/frame_alignment.hpp"
#include "modules/pose_graph/robust/public_graph.hpp"
#include "modules/pose_graph/stiefel.hpp"

namespace km {
namespace {

// The vote is quadratic in its candidates; of more, every so many-th is heard.
constexpr std::size_t kMaxVotes = 300;

// Places one robot beside those that have a frame.
class Placement {
 public:
  Placement(const GncHellos& hellos, const PublicGraph& graph,
            const std::map<RobotId, SE3>& T_world_start, RobotId self)
      : hellos_(hellos), graph_(graph), T_world_start_(T_world_start), self_(self) {}

  [[nodiscard]] SE3 frame() const {
    std::vector<const PublicGraph::Link*> links;
    for (const PublicGraph::Link& link : graph_.links()) {
      if (!joins(link)) continue;
      if (link.odometry) return T_world_pose(link) * own_start(link).inverse();
      links.push_back(&link);
    }
    const std::size_t stride = (links.size() + kMaxVotes - 1) / kMaxVotes;
    SE3 T_start_centre = SE3::Identity();  // see align_frames()
    for (const auto* link : links) T_start_centre.translation() += own_start(*link).translation();
    T_start_centre.translation() /= static_cast<double>(links.size());
    std::vector<Eigen::MatrixXd> candidates;
    for (std::size_t k = 0; k < links.size(); k += stride)
      candidates.emplace_back(
          (T_world_pose(*links[k]) * own_start(*links[k]).inverse() * T_start_centre)
              .matrix()
              .topRows<3>());
    SE3 T_world_centre = SE3::Identity();
    T_world_centre.matrix().topRows<3>() = align_frames(candidates, {}).value().L;
    return T_world_centre * T_start_centre.inverse();
  }

  [[nodiscard]] bool joins(const PublicGraph::Link& link) const {
    return (link.a == self_ && T_world_start_.contains(link.b)) ||
           (link.b == self_ && T_world_start_.contains(link.a));
  }

 private:
  [[nodiscard]] bool is_own(Eigen::Index node) const {
    return node >= graph_.first(self_) && node < graph_.first(self_) + graph_.sizes().at(self_);
  }
  [[nodiscard]] const SE3& start(RobotId robot, Eigen::Index node) const {
    return hellos_.at(robot).T_start_pose[static_cast<std::size_t>(node - graph_.first(robot))];
  }
  [[nodiscard]] const SE3& own_start(const PublicGraph::Link& link) const {
    return start(self_, is_own(link.i) ? link.i : link.j);
  }
  // Where the link puts this robot's end of it.
  [[nodiscard]] SE3 T_world_pose(const PublicGraph::Link& link) const {
    const RobotId other = link.a == self_ ? link.b : link.a;
    const SE3& T_world_other = T_world_start_.at(other);
    return is_own(link.i) ? T_world_other * start(other, link.j) * link.T_i_j.inverse()
                          : T_world_other * start(other, link.i) * link.T_i_j;
  }

  const GncHellos& hellos_;
  const PublicGraph& graph_;
  const std::map<RobotId, SE3>& T_world_start_;
  RobotId self_;
};

}  // namespace

std::map<RobotId, SE3> align_starts(const GncHellos& hellos, const PublicGraph& graph) {
  std::map<RobotId, SE3> T_world_start;
  for (const auto& [robot, hello] : hellos)
    if (hello.common_frame) T_world_start[robot] = SE3::Identity();
  if (T_world_start.empty()) T_world_start[hellos.begin()->first] = SE3::Identity();
  while (T_world_start.size() < hellos.size()) {
    std::map<RobotId, std::size_t> links;  // to robots placed
    for (const auto& [robot, hello] : hellos) {
      if (T_world_start.contains(robot)) continue;
      const Placement placement(hellos, graph, T_world_start, robot);
      links[robot] = static_cast<std::size_t>(
          std::count_if(graph.links().begin(), graph.links().end(),
                        [&](const auto& link) { return placement.joins(link); }));
    }
    const auto next =
        std::max_element(links.begin(), links.end(),
                         [](const auto& one, const auto& two) { return one.second < two.second; });
    if (next->second == 0)
      throw std::invalid_argument("align_starts: nothing joins robot " +
                                  std::to_string(next->first) + " to the others");
    T_world_start[next->first] = Placement(hellos, graph, T_world_start, next->first).frame();
  }
  return T_world_start;
}

}  // namespace km
