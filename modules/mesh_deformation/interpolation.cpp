#include "modules/mesh_deformation/interpolation.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <nanoflann.hpp>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "modules/mesh_deformation/mesh_node.hpp"

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
  std::vector<std::uint32_t> indices;

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
                std::span<NearNode> found, double limit2)
      : nodes_(nodes), seen_by_(seen_by), window_(window), found_(found), limit2_(limit2) {}

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool full() const { return count_ == found_.size(); }
  [[nodiscard]] double worstDist() const { return full() ? found_[count_ - 1].distance2 : limit2_; }

  bool addPoint(double distance2, std::uint32_t i) {
    if (distance2 >= worstDist() || keyframe_gap(nodes_.seen_by[i], seen_by_) > window_)
      return true;
    const std::uint32_t node = nodes_.indices[i];
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
  double limit2_;
  std::size_t count_ = 0;
};

// A k-d tree of nodes. Finds the nearest nodes among those whose keyframe_gap() is within the
// window.
class NodeTree {
 public:
  // Copies those of `nodes` that are listed.
  NodeTree(std::span<const MeshNode> nodes, std::span<const std::uint32_t> listed,
           KeyframeIndex max_gap_keyframes)
      : nodes_(chosen(nodes, listed)), window_(max_gap_keyframes), index_(3, nodes_) {}

  // Fills `found` with the nearest nodes whose keyframe_gap() to `seen_by` is within the window, by
  // distance, closer than the square root of `limit2`. Returns their number.
  std::size_t nearest(const Eigen::Vector3d& point, const SeenBy& seen_by,
                      std::span<NearNode> found,
                      double limit2 = std::numeric_limits<double>::infinity()) const {
    if (found.empty()) return 0;
    NearestInTime nearest(nodes_, seen_by, window_, found, limit2);
    index_.findNeighbors(nearest, point.data(), {});
    return nearest.size();
  }

 private:
  static Nodes chosen(std::span<const MeshNode> nodes, std::span<const std::uint32_t> listed) {
    Nodes result;
    for (const std::uint32_t i : listed) {
      result.positions.push_back(nodes[i].position);
      result.seen_by.push_back(nodes[i].seen_by);
      result.indices.push_back(i);
    }
    return result;
  }

  Nodes nodes_;
  KeyframeIndex window_;
  nanoflann::KDTreeSingleIndexAdaptor<
      nanoflann::L2_Simple_Adaptor<double, Nodes, double, std::uint32_t>, Nodes, 3, std::uint32_t>
      index_;  // refers to nodes_
};

constexpr std::size_t kMaxNeighbours = 8;
constexpr double kNoWeight = 1e-12;  // a smaller sum of weights counts as zero

// Nodes of one vertex, and the distance below which a new node would change them.
struct Binding {
  std::array<std::uint32_t, kMaxNeighbours> nodes;
  std::array<double, kMaxNeighbours> weights;
  float rebind_distance_m = std::numeric_limits<float>::infinity();
};

// Eq. (3) for the nearest nodes; the last of them gives d_max.
Binding weigh(std::span<const NearNode> nearest, bool all_found) {
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
  if (all_found)
    binding.rebind_distance_m =
        std::nextafter(static_cast<float>(d_max), std::numeric_limits<float>::max());
  return binding;
}

Binding bind_vertex(const NodeTree& tree, const Eigen::Vector3f& vertex, const SeenBy& seen_by,
                    std::size_t neighbours) {
  std::array<NearNode, kMaxNeighbours + 1> found;
  const std::size_t count =
      tree.nearest(vertex.cast<double>(), seen_by, std::span(found).first(neighbours + 1));
  return weigh(std::span(found).first(count), count == neighbours + 1);
}

// Motion of the surface around a node: v' - v = turn (v - g) + shift. Zero for a node that does not
// move.
struct NodeMotion {
  Eigen::Matrix3d turn;
  Eigen::Vector3d shift;
  Eigen::Vector3d g;
};

}  // namespace

Interpolation::Interpolation(std::size_t neighbours, KeyframeIndex max_gap_keyframes)
    : neighbours_(std::clamp<std::size_t>(neighbours, 1, kMaxNeighbours)),
      max_gap_keyframes_(max_gap_keyframes) {}

void Interpolation::bind(std::span<const Eigen::Vector3f> vertices, std::span<const SeenBy> seen_by,
                         std::span<const MeshNode> nodes) {
  const std::vector<std::uint32_t> all_new(vertices.size(), kNoIndex);
  update(vertices, seen_by, nodes, all_new, {});
}

void Interpolation::update(std::span<const Eigen::Vector3f> vertices,
                           std::span<const SeenBy> seen_by, std::span<const MeshNode> nodes,
                           std::span<const std::uint32_t> before,
                           std::span<const std::uint32_t> changed) {
  std::vector<std::uint32_t> all(nodes.size());
  std::iota(all.begin(), all.end(), 0U);
  const NodeTree tree(nodes, all, max_gap_keyframes_);
  const NodeTree changed_tree(nodes, changed, max_gap_keyframes_);
  Interpolation next(neighbours_, max_gap_keyframes_);
  next.nodes_.resize(vertices.size() * neighbours_);
  next.weights_.resize(vertices.size() * neighbours_);
  next.rebind_distance_m_.resize(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const std::size_t to = v * neighbours_;
    const std::uint32_t old = before[v];
    if (old != kNoIndex) {
      const double rebind_distance_m = rebind_distance_m_[old];
      NearNode closer;
      if (changed_tree.nearest(vertices[v].cast<double>(), seen_by[v], {&closer, 1},
                               rebind_distance_m * rebind_distance_m) == 0) {
        std::ranges::copy(nodes_of(old), next.nodes_.begin() + static_cast<std::ptrdiff_t>(to));
        std::ranges::copy(weights_of(old), next.weights_.begin() + static_cast<std::ptrdiff_t>(to));
        next.rebind_distance_m_[v] = rebind_distance_m_[old];
        continue;
      }
    }
    const Binding binding = bind_vertex(tree, vertices[v], seen_by[v], neighbours_);
    for (std::size_t j = 0; j < neighbours_; ++j) {
      next.nodes_[to + j] = binding.nodes[j];
      next.weights_[to + j] = binding.weights[j];
    }
    next.rebind_distance_m_[v] = binding.rebind_distance_m;
  }
  *this = std::move(next);
}

std::vector<Eigen::Vector3f> Interpolation::deform(std::span<const Eigen::Vector3f> vertices,
                                                   std::span<const SeenBy> seen_by,
                                                   std::span<const MeshNode> nodes,
                                                   std::span<const SE3> T_world_node,
                                                   std::span<const SE3> T_world_odom_of_kf) const {
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
    const auto nodes_here = nodes_of(v);
    const auto weights = weights_of(v);
    if (nodes_here.front() == kNoIndex) {
      deformed.push_back((T_world_odom_of_kf[seen_by[v][0]] * vertex).cast<float>());
      continue;
    }
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // Eq. (2) minus the vertex
    for (std::size_t j = 0; j < neighbours_ && nodes_here[j] != kNoIndex; ++j) {
      const NodeMotion& motion = motions[nodes_here[j]];
      displacement += weights[j] * (motion.turn * (vertex - motion.g) + motion.shift);
    }
    deformed.push_back((vertex + displacement).cast<float>());
  }
  return deformed;
}

std::size_t Interpolation::unbound_count() const {
  std::size_t count = 0;
  for (std::size_t v = 0; v < vertex_count(); ++v)
    if (nodes_of(v).front() == kNoIndex) ++count;
  return count;
}

std::span<const std::uint32_t> Interpolation::nodes_of(std::size_t vertex) const {
  return std::span(nodes_).subspan(vertex * neighbours_, neighbours_);
}

std::span<const double> Interpolation::weights_of(std::size_t vertex) const {
  return std::span(weights_).subspan(vertex * neighbours_, neighbours_);
}

}  // namespace km
