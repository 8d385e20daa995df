#include "modules/mesh_deformation/interpolation.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

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

}  // namespace

TEST_CASE("Weights are (1 - d/d_max)^2, normalised") {
  Scene scene;
  scene.add_vertex({0, 0, 0}, {0, 0});
  for (const double x : {1.0, 2.0, 4.0}) scene.add_node({x, 0, 0}, {0, 0}, moved_to(x, 0, 0));
  const auto bound = [&] {
    return bind_to_nodes(scene.vertices, scene.seen_by, scene.nodes, 2, 0).front();
  };
  // d_max = 4: (3/4)^2 and (1/2)^2
  CHECK(bound().weights[0] == Approx(9.0 / 13.0));
  CHECK(bound().weights[1] == Approx(4.0 / 13.0));

  SECTION("with as few nodes as k the farthest gives d_max") {
    scene.nodes.pop_back();
    CHECK(bound().nodes[0] == 0U);
    CHECK(bound().nodes[1] == kNoIndex);
    CHECK(bound().weights[0] == Approx(1.0));
  }
  SECTION("nodes equally far have equal weights") {
    for (auto& node : scene.nodes) node.position = {0, 2, 0};
    CHECK(bound().weights[0] == Approx(0.5));
    CHECK(bound().weights[1] == Approx(0.5));
  }
}

TEST_CASE("The nodes of a vertex are those of an exhaustive search") {
  const auto seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Scene scene = random_scene(rng, 200, 60);
  constexpr std::size_t kNeighbours = 4;
  constexpr KeyframeIndex kWindow = 5;
  const auto bindings =
      bind_to_nodes(scene.vertices, scene.seen_by, scene.nodes, kNeighbours, kWindow);
  for (std::size_t v = 0; v < scene.vertices.size(); ++v) {
    std::vector<std::pair<double, std::uint32_t>> near;
    for (std::uint32_t n = 0; n < scene.nodes.size(); ++n)
      if (keyframe_gap(scene.nodes[n].seen_by, scene.seen_by[v]) <= kWindow)
        near.emplace_back(
            (scene.nodes[n].position - scene.vertices[v].cast<double>()).squaredNorm(), n);
    std::ranges::sort(near);
    const std::size_t expected =
        near.empty() ? 0 : std::clamp<std::size_t>(near.size() - 1, 1, kNeighbours);
    const auto& found = bindings[v].nodes;
    CAPTURE(v);
    for (std::size_t j = 0; j < kNeighbours; ++j)
      CHECK(found[j] == (j < expected ? near[j].second : kNoIndex));
  }
}

TEST_CASE("A vertex without a node near in time moves with its keyframe") {
  Scene scene;
  scene.add_vertex({1, 2, 3}, {7, 9});
  scene.add_node({1, 2, 3}, {100, 110}, moved_to(50, 0, 0));
  const auto bindings = bind_to_nodes(scene.vertices, scene.seen_by, scene.nodes, 4, 10);
  CHECK_FALSE(bindings.front().is_bound());
  std::vector<SE3> corrections(10, SE3::Identity());
  corrections[7] = moved_to(0, 1, 0);
  const auto deformed = deform_vertices(scene.vertices, scene.seen_by, scene.nodes, bindings,
                                        scene.T_world_node, corrections);
  CHECK((deformed[0] - Eigen::Vector3f(1, 3, 3)).norm() < 1e-6F);
}

}  // namespace km
