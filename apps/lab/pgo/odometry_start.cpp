#include "apps/lab/pgo/odometry_start.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/pose_graph/frame_alignment.hpp"

namespace km {
namespace {

using Eigen::Index;

// Maximum number of candidates, because the vote is quadratic in them. A larger set is subsampled
// evenly.
constexpr std::size_t kMaxVotes = 300;

// Poses of `robot` in the frame of its first one.
std::vector<SE3> chained(const TeamGraph& graph, const std::vector<bool>& odometry,
                         std::size_t robot) {
  const Index begin = graph.first[robot], end = graph.first[robot + 1];
  std::vector<std::size_t> edges;
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    const auto [low, high] = std::minmax(graph.edges[k].i, graph.edges[k].j);
    if (begin <= low && high < end) edges.push_back(k);
  }
  std::stable_sort(edges.begin(), edges.end(), [&](std::size_t a, std::size_t b) {
    return graph.edges[a].i < graph.edges[b].i;
  });
  std::vector<std::optional<SE3>> reached(static_cast<std::size_t>(end - begin));
  reached[0] = SE3::Identity();
  const auto reach_on = [&](bool step) {
    bool any = false;
    for (const std::size_t k : edges) {
      const BlockEdge& e = graph.edges[k];
      auto& i = reached[static_cast<std::size_t>(e.i - begin)];
      auto& j = reached[static_cast<std::size_t>(e.j - begin)];
      if (odometry[k] != step || i.has_value() == j.has_value()) continue;
      if (i)
        j = *i * e.T_i_j;
      else
        i = *j * e.T_i_j.inverse();
      any = true;
      // After one edge that is not odometry, odometry is tried again.
      if (!step) break;
    }
    return any;
  };
  while (reach_on(true) || reach_on(false)) continue;
  std::vector<SE3> poses;
  for (const auto& T : reached) {
    if (!T)
      throw std::invalid_argument("robot " + std::to_string(robot) +
                                  ": no edge leads to its pose " + std::to_string(poses.size()));
    poses.push_back(*T);
  }
  return poses;
}

// Placement of a robot without a place by one edge to a robot with a place. "End" is the pose of
// the former on which the edge ends.
struct Vote {
  SE3 T_world_end;  // placed end in the common frame
  SE3 T_own_end;    // same pose in the frame of its own robot
  bool odometry = false;
};

SE3 elected(const std::vector<Vote>& votes) {
  for (const Vote& vote : votes)
    if (vote.odometry) return vote.T_world_end * vote.T_own_end.inverse();
  SE3 T_own_centre = SE3::Identity();  // see align_frames()
  for (const Vote& vote : votes) T_own_centre.translation() += vote.T_own_end.translation();
  T_own_centre.translation() /= static_cast<double>(votes.size());
  const std::size_t stride = (votes.size() + kMaxVotes - 1) / kMaxVotes;
  std::vector<SE3> candidates;
  for (std::size_t k = 0; k < votes.size(); k += stride)
    candidates.push_back(votes[k].T_world_end * votes[k].T_own_end.inverse() * T_own_centre);
  return align_frames(candidates).value().T * T_own_centre.inverse();
}

}  // namespace

std::vector<SE3> odometry_start(const TeamGraph& graph) {
  const std::vector<bool> odometry = odometry_edges(graph);
  std::vector<SE3> poses;
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    const std::vector<SE3> own = chained(graph, odometry, k);
    poses.insert(poses.end(), own.begin(), own.end());
  }
  return placed_by_closures(graph, std::move(poses));
}

std::vector<SE3> placed_by_closures(const TeamGraph& graph, std::vector<SE3> poses) {
  const std::vector<bool> odometry = odometry_edges(graph);
  std::vector<bool> placed(graph.robots(), false);
  placed[0] = true;
  for (std::size_t n = 1; n < graph.robots(); ++n) {
    std::map<std::size_t, std::vector<Vote>> votes;
    for (std::size_t k = 0; k < graph.edges.size(); ++k) {
      const BlockEdge& e = graph.edges[k];
      const std::size_t a = graph.robot_of(e.i), b = graph.robot_of(e.j);
      if (placed[a] == placed[b]) continue;
      const SE3& T_i = poses[static_cast<std::size_t>(e.i)];
      const SE3& T_j = poses[static_cast<std::size_t>(e.j)];
      if (placed[a])
        votes[b].push_back({T_i * e.T_i_j, T_j, odometry[k]});
      else
        votes[a].push_back({T_j * e.T_i_j.inverse(), T_i, odometry[k]});
    }
    if (votes.empty()) throw std::invalid_argument("the graph does not join all robots");
    const auto next = std::max_element(
        votes.begin(), votes.end(),
        [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
    const SE3 T_world_own = elected(next->second);
    for (Index i = graph.first[next->first]; i < graph.first[next->first + 1]; ++i)
      poses[static_cast<std::size_t>(i)] = T_world_own * poses[static_cast<std::size_t>(i)];
    placed[next->first] = true;
  }
  return poses;
}

}  // namespace km
