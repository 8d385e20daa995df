#include "modules/mesh_deformation/interpolation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

namespace km {
namespace {

// A node and its squared distance [m^2] from the query point.
struct NearNode {
  double distance2 = 0.0;
  std::uint32_t node = kNoIndex;
};

struct Nodes {
  std::vector<Eigen::Vector3d> positions;
  std::vector<SeenBy> seen_by;

  // Interface that nanoflann requires of a set of points.
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return positions.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return positions[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

// The nearest points so far, for nanoflann. Points whose keyframe_gap() exceeds the window are
// ignored. At equal distance the lower index comes first.
class NearestInTime {
 public:
  using DistanceType = double;
  using IndexType = std::uint32_t;

  NearestInTime(const Nodes& nodes, const SeenBy& seen_by, KeyframeIndex window,
                std::span<NearNode> found)
      : nodes_(nodes), seen_by_(seen_by), window_(window), found_(found) {}

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool full() const { return count_ == found_.size(); }
  [[nodiscard]] double worstDist() const {
    return full() ? found_[count_ - 1].distance2 : std::numeric_limits<double>::infinity();
  }

  bool addPoint(double distance2, std::uint32_t node) {
    if (distance2 >= worstDist() || keyframe_gap(nodes_.seen_by[node], seen_by_) > window_)
      return true;
    std::size_t place = full() ? count_ - 1 : count_++;
    for (; place > 0; --place) {
      const NearNode& closer = found_[place - 1];
      if (closer.distance2 < distance2 || (closer.distance2 == distance2 && closer.node < node))
        break;
      found_[place] = closer;
    }
    found_[place] = {distance2, node};
    return true;
  }

  void sort() {}  // nanoflann 1.5 calls it at the end; the points are sorted already

 private:
  const Nodes& nodes_;
  const SeenBy& seen_by_;
  KeyframeIndex window_;
  std::span<NearNode> found_;
  std::size_t count_ = 0;
};

// A k-d tree of nodes. Finds the nearest nodes among those whose keyframe_gap() is within the
// window.
class NodeTree {
 public:
  NodeTree(std::span<const MeshNode> nodes, KeyframeIndex max_gap_keyframes)
      : nodes_(copied(nodes)), window_(max_gap_keyframes), index_(3, nodes_) {}

  // Fills `found` with the nearest nodes whose keyframe_gap() to `seen_by` is within the window, by
  // distance. Returns their number.
  std::size_t nearest(const Eigen::Vector3d& point, const SeenBy& seen_by,
                      std::span<NearNode> found) const {
    NearestInTime nearest(nodes_, seen_by, window_, found);
    index_.findNeighbors(nearest, point.data(), {});
    return nearest.size();
  }

 private:
  static Nodes copied(std::span<const MeshNode> nodes) {
    Nodes result;
    for (const MeshNode& node : nodes) {
      result.positions.push_back(node.position);
      result.seen_by.push_back(node.seen_by);
    }
    return result;
  }

  Nodes nodes_;
  KeyframeIndex window_;
  nanoflann::KDTreeSingleIndexAdaptor<
      nanoflann::L2_Simple_Adaptor<double, Nodes, double, std::uint32_t>, Nodes, 3, std::uint32_t>
      index_;  // refers to nodes_
};

constexpr double kNoWeight = 1e-12;  // a smaller sum of weights counts as zero

// Eq. (3) for the nearest nodes; the last of them gives d_max.
Binding weigh(std::span<const NearNode> nearest) {
  Binding binding;
  binding.nodes.fill(kNoIndex);
  binding.weights.fill(0.0);
  if (nearest.empty()) return binding;
  const double d_max = std::sqrt(nearest.back().distance2);
  const std::size_t used = std::max<std::size_t>(nearest.size() - 1, 1);
  double sum = 0.0;
  for (std::size_t j = 0; j < used; ++j) {
    const double root = d_max > 0.0 ? 1.0 - std::sqrt(nearest[j].distance2) / d_max : 0.0;
    binding.nodes[j] = nearest[j].node;
    binding.weights[j] = root * root;
    sum += root * root;
  }
  // If all nodes are equally far, the sum is zero, and the weights are made equal.
  for (std::size_t j = 0; j < used; ++j)
    binding.weights[j] =
        sum > kNoWeight ? binding.weights[j] / sum : 1.0 / static_cast<double>(used);
  return binding;
}

// Motion of the surface around a node: v' - v = turn (v - g) + shift. Zero for a node that does not
// move.
struct NodeMotion {
  Eigen::Matrix3d turn;
  Eigen::Vector3d shift;
  Eigen::Vector3d g;
};

}  // namespace

std::vector<Binding> bind_to_nodes(std::span<const Eigen::Vector3f> vertices,
                                   std::span<const SeenBy> seen_by, std::span<const MeshNode> nodes,
                                   std::size_t neighbours, KeyframeIndex max_gap_keyframes) {
  const NodeTree tree(nodes, max_gap_keyframes);
  std::vector<Binding> bindings;
  bindings.reserve(vertices.size());
  std::array<NearNode, kMaxNeighbours + 1> found;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const std::size_t count = tree.nearest(vertices[v].cast<double>(), seen_by[v],
                                           std::span(found).first(neighbours + 1));
    bindings.push_back(weigh(std::span(found).first(count)));
  }
  return bindings;
}

std::vector<Eigen::Vector3f> deform_vertices(std::span<const Eigen::Vector3f> vertices,
                                             std::span<const SeenBy> seen_by,
                                             std::span<const MeshNode> nodes,
                                             std::span<const Binding> bindings,
                                             std::span<const SE3> T_world_node,
                                             std::span<const SE3> T_world_odom_of_kf) {
  std::vector<NodeMotion> motions;
  motions.reserve(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const Eigen::Vector3d& g = nodes[n].position;
    motions.push_back({T_world_node[n].linear() - Eigen::Matrix3d::Identity(),
                       T_world_node[n].translation() - g, g});
  }
  std::vector<Eigen::Vector3f> deformed;
  deformed.reserve(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Eigen::Vector3d vertex = vertices[v].cast<double>();
    const Binding& binding = bindings[v];
    if (!binding.is_bound()) {
      deformed.push_back((T_world_odom_of_kf[seen_by[v][0]] * vertex).cast<float>());
      continue;
    }
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // Eq. (2) minus the vertex
    for (std::size_t j = 0; j < kMaxNeighbours && binding.nodes[j] != kNoIndex; ++j) {
      const NodeMotion& motion = motions[binding.nodes[j]];
      displacement += binding.weights[j] * (motion.turn * (vertex - motion.g) + motion.shift);
    }
    deformed.push_back((vertex + displacement).cast<float>());
  }
  return deformed;
}

}  // namespace km
