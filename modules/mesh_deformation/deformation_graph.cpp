#include "modules/mesh_deformation/deformation_graph.hpp"

#include <algorithm>

namespace km {
namespace {

// Appends count values from first to last, both included, evenly spread; fewer if there are fewer.
void spread(KeyframeIndex first, KeyframeIndex last, std::size_t count, std::uint32_t node,
            std::vector<KeyframeTie>& ties) {
  const std::size_t steps = std::min<std::size_t>(count - 1, last - first);
  if (steps == 0) {
    ties.push_back({first, node});
    return;
  }
  for (std::size_t i = 0; i <= steps; ++i)
    ties.push_back({first + static_cast<KeyframeIndex>((last - first) * i / steps), node});
}

// How a keyframe's surroundings move: to its pose `to` from where they were at `from`.
SE3 correction(const SE3& to, const SE3& from) {
  return to * from.inverse();
}

// First tie of every node; ties.size() where it has none.
std::vector<std::size_t> first_ties(const DeformationGraph& graph) {
  std::vector<std::size_t> first(graph.nodes.size(), graph.ties.size());
  for (std::size_t i = graph.ties.size(); i-- > 0;) first[graph.ties[i].node] = i;
  return first;
}

}  // namespace

std::vector<KeyframeTie> choose_ties(std::span<const MeshNode> nodes,
                                     std::size_t keyframes_per_node,
                                     KeyframeIndex window_keyframes) {
  std::vector<KeyframeTie> ties;
  ties.reserve(nodes.size() * keyframes_per_node);
  for (std::uint32_t n = 0; n < nodes.size(); ++n) {
    const auto [first, last] = nodes[n].seen_by;
    if (last - first <= window_keyframes || keyframes_per_node == 1) {
      spread(first, last, keyframes_per_node, n, ties);
    } else {
      ties.push_back({first, n});
      ties.push_back({last, n});
    }
  }
  return ties;
}

const char* to_string(DeformationStatus status) {
  switch (status) {
    case DeformationStatus::kConverged:
      return "converged";
    case DeformationStatus::kIterationLimit:
      return "iteration limit";
    case DeformationStatus::kFailed:
      return "failed";
  }
  return "unknown";
}

DeformationPoses initial_poses(const DeformationGraph& graph, std::span<const SE3> T_world_kf) {
  DeformationPoses poses;
  poses.T_world_kf.assign(T_world_kf.begin(), T_world_kf.end());
  std::vector<SE3> T_world_odom;
  T_world_odom.reserve(T_world_kf.size());
  for (std::size_t i = 0; i < T_world_kf.size(); ++i)
    T_world_odom.push_back(correction(T_world_kf[i], graph.T_odom_kf[i]));

  std::vector<Eigen::Vector3d> sums(graph.nodes.size(), Eigen::Vector3d::Zero());
  std::vector<int> counts(graph.nodes.size(), 0);
  for (const KeyframeTie& tie : graph.ties) {
    sums[tie.node] += T_world_odom[tie.keyframe] * graph.nodes[tie.node];
    ++counts[tie.node];
  }
  const std::vector<std::size_t> first = first_ties(graph);
  poses.T_world_node.reserve(graph.nodes.size());
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    if (counts[n] == 0) {
      poses.T_world_node.push_back(make_pose(Eigen::Matrix3d::Identity(), graph.nodes[n]));
      continue;
    }
    const KeyframeIndex keyframe = graph.ties[first[n]].keyframe;
    poses.T_world_node.push_back(make_pose(T_world_odom[keyframe].linear(), sums[n] / counts[n]));
  }
  return poses;
}

DeformationPoses carried_over_poses(const DeformationGraph& graph, const DeformationPoses& last,
                                    std::span<const SE3> T_world_kf_last,
                                    std::span<const SE3> T_world_kf) {
  DeformationPoses poses = initial_poses(graph, T_world_kf);
  std::vector<SE3> moved;  // of each keyframe that was there, since
  for (std::size_t i = 0; i < std::min(T_world_kf_last.size(), T_world_kf.size()); ++i) {
    moved.push_back(correction(T_world_kf[i], T_world_kf_last[i]));
    if (i < last.T_world_kf.size()) poses.T_world_kf[i] = moved[i] * last.T_world_kf[i];
  }
  const std::vector<std::size_t> first = first_ties(graph);
  for (std::size_t n = 0; n < std::min(last.T_world_node.size(), graph.nodes.size()); ++n) {
    if (first[n] == graph.ties.size()) {
      poses.T_world_node[n] = last.T_world_node[n];
      continue;
    }
    const KeyframeIndex keyframe = graph.ties[first[n]].keyframe;
    if (keyframe < moved.size()) poses.T_world_node[n] = moved[keyframe] * last.T_world_node[n];
  }
  return poses;
}

}  // namespace km
