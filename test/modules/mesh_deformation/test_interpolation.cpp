#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "modules/mesh_deformation/interpolation.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

struct Scene {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<SeenBy> seen_by;
  std::vector<MeshNode> nodes;
  std::vector<SE3> T_world_node;

  void add_vertex(const Eigen::Vector3f& v, SeenBy seen) {
    vertices.push_back(v);
    seen_by.push_back(seen);
  }
  void add_node(const Eigen::Vector3d& g, SeenBy seen, const SE3& T) {
    nodes.push_back({g, seen});
    T_world_node.push_back(T);
  }
};

SE3 moved_to(double x, double y, double z) {
  return make_pose(Eigen::Matrix3d::Identity(), {x, y, z});
}

Scene random_scene(std::mt19937& rng, std::size_t vertices, std::size_t nodes) {
  std::uniform_int_distribution<KeyframeIndex> keyframe(0, 60);
  Scene scene;
  const auto seen = [&]() -> SeenBy {
    const KeyframeIndex a = keyframe(rng);
    const KeyframeIndex b = keyframe(rng);
    return {std::min(a, b), std::min(a, b) + (std::max(a, b) - std::min(a, b)) / 6};
  };
  for (std::size_t i = 0; i < nodes; ++i) {
    const Eigen::Vector3d g = random_vector<3>(rng);
    const SeenBy when = seen();
    scene.add_node(g, when, random_pose(rng, 1.0));
  }
  for (std::size_t i = 0; i < vertices; ++i) {
    const Eigen::Vector3f v = random_vector<3>(rng).cast<float>();
    scene.add_vertex(v, seen());
  }
  return scene;
}

void check_same(const Interpolation& a, const Interpolation& b) {
  REQUIRE(a.vertex_count() == b.vertex_count());
  for (std::size_t v = 0; v < a.vertex_count(); ++v) {
    CAPTURE(v);
    CHECK(std::ranges::equal(a.nodes_of(v), b.nodes_of(v)));
    CHECK(std::ranges::equal(a.weights_of(v), b.weights_of(v)));
  }
}

}  // namespace

TEST_CASE("Weights are (1 - d/d_max)^2, normalised", "[mesh_deformation]") {
  Scene scene;
  scene.add_vertex({0, 0, 0}, {0, 0});
  for (const double x : {1.0, 2.0, 4.0}) scene.add_node({x, 0, 0}, {0, 0}, moved_to(x, 0, 0));
  Interpolation interpolation(2, 0);
  interpolation.bind(scene.vertices, scene.seen_by, scene.nodes);
  const auto weights = interpolation.weights_of(0);  // d_max = 4: (3/4)^2 and (1/2)^2
  CHECK(weights[0] == Approx(9.0 / 13.0));
  CHECK(weights[1] == Approx(4.0 / 13.0));

  SECTION("with as few nodes as k the farthest gives d_max") {
    scene.nodes.pop_back();
    interpolation.bind(scene.vertices, scene.seen_by, scene.nodes);
    CHECK(interpolation.nodes_of(0)[0] == 0U);
    CHECK(interpolation.nodes_of(0)[1] == kNoIndex);
    CHECK(interpolation.weights_of(0)[0] == Approx(1.0));
  }
  SECTION("nodes equally far have equal weights") {
    for (auto& node : scene.nodes) node.position = {0, 2, 0};
    interpolation.bind(scene.vertices, scene.seen_by, scene.nodes);
    CHECK(interpolation.weights_of(0)[0] == Approx(0.5));
    CHECK(interpolation.weights_of(0)[1] == Approx(0.5));
  }
}

TEST_CASE("The nodes of a vertex are those of an exhaustive search", "[mesh_deformation]") {
  const auto seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Scene scene = random_scene(rng, 200, 60);
  constexpr std::size_t kNeighbours = 4;
  constexpr KeyframeIndex kWindow = 5;
  Interpolation interpolation(kNeighbours, kWindow);
  interpolation.bind(scene.vertices, scene.seen_by, scene.nodes);
  for (std::size_t v = 0; v < scene.vertices.size(); ++v) {
    std::vector<std::pair<double, std::uint32_t>> near;
    for (std::uint32_t n = 0; n < scene.nodes.size(); ++n)
      if (keyframe_gap(scene.nodes[n].seen_by, scene.seen_by[v]) <= kWindow)
        near.emplace_back(
            (scene.nodes[n].position - scene.vertices[v].cast<double>()).squaredNorm(), n);
    std::ranges::sort(near);
    const std::size_t expected =
        near.empty() ? 0 : std::clamp<std::size_t>(near.size() - 1, 1, kNeighbours);
    const auto found = interpolation.nodes_of(v);
    CAPTURE(v);
    for (std::size_t j = 0; j < kNeighbours; ++j)
      CHECK(found[j] == (j < expected ? near[j].second : kNoIndex));
  }
}

TEST_CASE("An updated binding equals a new binding", "[mesh_deformation]") {
  const auto seed = GENERATE(range(0U, 4U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Scene later = random_scene(rng, 400, 50);
  const std::size_t old_nodes = GENERATE(2, 40, 50);
  CAPTURE(old_nodes);
  Scene earlier = later;
  earlier.nodes.resize(old_nodes);

  std::vector<std::uint32_t> changed;
  for (std::uint32_t n = 0; n < later.nodes.size(); ++n) {
    if (n % 7 == 0 && n < old_nodes) earlier.nodes[n].seen_by[1] = later.nodes[n].seen_by[0];
    if (n >= old_nodes || earlier.nodes[n].seen_by != later.nodes[n].seen_by) changed.push_back(n);
  }
  // The earlier mesh lacks some vertices, and has others at other positions and in another order.
  earlier.vertices.clear();
  earlier.seen_by.clear();
  std::vector<std::uint32_t> before(later.vertices.size(), kNoIndex);
  for (std::size_t v = 0; v < later.vertices.size(); ++v) {
    if (v % 5 == 0) continue;
    if (v % 11 != 0) before[v] = static_cast<std::uint32_t>(earlier.vertices.size());
    const float off = v % 11 == 0 ? 0.5F : 0.0F;
    earlier.add_vertex(later.vertices[v] + Eigen::Vector3f::Constant(off), later.seen_by[v]);
  }
  Interpolation updated(4, 5);
  updated.bind(earlier.vertices, earlier.seen_by, earlier.nodes);
  updated.update(later.vertices, later.seen_by, later.nodes, before, changed);
  Interpolation anew(4, 5);
  anew.bind(later.vertices, later.seen_by, later.nodes);
  check_same(updated, anew);
}

TEST_CASE("A vertex without a node near in time moves with its keyframe", "[mesh_deformation]") {
  Scene scene;
  scene.add_vertex({1, 2, 3}, {7, 9});
  scene.add_node({1, 2, 3}, {100, 110}, moved_to(50, 0, 0));
  Interpolation interpolation(4, 10);
  interpolation.bind(scene.vertices, scene.seen_by, scene.nodes);
  CHECK(interpolation.unbound_count() == 1);
  std::vector<SE3> corrections(10, SE3::Identity());
  corrections[7] = moved_to(0, 1, 0);
  const auto deformed = interpolation.deform(scene.vertices, scene.seen_by, scene.nodes,
                                             scene.T_world_node, corrections);
  CHECK((deformed[0] - Eigen::Vector3f(1, 3, 3)).norm() < 1e-6F);
}

}  // namespace km
