#include "modules/mesh_deformation/node_tree.hpp"

#include <algorithm>
#include <nanoflann.hpp>
#include <numeric>
#include <utility>

namespace km {
namespace {

struct Nodes {
  std::vector<Eigen::Vector3d> positions;
  std::vector<SeenBy> seen_by;
  std::vector<std::uint32_t> indices;

  // What nanoflann asks of a set of points.
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return positions.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return positions[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

// The nearest points so far, for nanoflann; passes over those of another time. Of points at equal
// distance the lower index comes first.
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

 private:
  const Nodes& nodes_;
  const SeenBy& seen_by_;
  KeyframeIndex window_;
  std::span<NearNode> found_;
  double limit2_;
  std::size_t count_ = 0;
};

using Index = nanoflann::KDTreeSingleIndexAdaptor<
    nanoflann::L2_Simple_Adaptor<double, Nodes, double, std::uint32_t>, Nodes, 3, std::uint32_t>;

Nodes chosen(std::span<const MeshNode> nodes, std::span<const std::uint32_t> listed) {
  Nodes result;
  for (const std::uint32_t i : listed) {
    result.positions.push_back(nodes[i].position);
    result.seen_by.push_back(nodes[i].seen_by);
    result.indices.push_back(i);
  }
  return result;
}

std::vector<std::uint32_t> all(std::size_t count) {
  std::vector<std::uint32_t> indices(count);
  std::iota(indices.begin(), indices.end(), 0U);
  return indices;
}

}  // namespace

struct NodeTree::Tree {
  Tree(Nodes chosen_nodes, KeyframeIndex window_keyframes)
      : nodes(std::move(chosen_nodes)), window(window_keyframes), index(3, nodes) {}

  std::size_t search(const Eigen::Vector3d& point, const SeenBy& seen_by, std::span<NearNode> found,
                     double limit2) const {
    if (found.empty()) return 0;
    NearestInTime nearest(nodes, seen_by, window, found, limit2);
    index.findNeighbors(nearest, point.data(), nanoflann::SearchParams());
    return nearest.size();
  }

  Nodes nodes;
  KeyframeIndex window;
  Index index;  // refers to nodes
};

NodeTree::NodeTree(std::span<const MeshNode> nodes, KeyframeIndex window_keyframes)
    : NodeTree(nodes, all(nodes.size()), window_keyframes) {}

NodeTree::NodeTree(std::span<const MeshNode> nodes, std::span<const std::uint32_t> listed,
                   KeyframeIndex window_keyframes)
    : tree_(std::make_unique<Tree>(chosen(nodes, listed), window_keyframes)) {}

NodeTree::~NodeTree() = default;

std::size_t NodeTree::nearest(const Eigen::Vector3d& point, const SeenBy& seen_by,
                              std::span<NearNode> found) const {
  return tree_->search(point, seen_by, found, std::numeric_limits<double>::infinity());
}

bool NodeTree::any_within(const Eigen::Vector3d& point, const SeenBy& seen_by,
                          double distance2) const {
  NearNode found;
  return tree_->search(point, seen_by, {&found, 1}, distance2) > 0;
}

}  // namespace km
