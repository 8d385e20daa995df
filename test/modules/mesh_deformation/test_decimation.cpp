#include "modules/mesh_deformation/decimation.hpp"
#include "test/modules/mesh_deformation/corridor.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr DecimationScale kScale{1.0, 50};

double nearest_other_m(const std::vector<MeshNode>& nodes, std::size_t i) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < nodes.size(); ++j)
    if (j != i) nearest = std::min(nearest, (nodes[i].position - nodes[j].position).norm());
  return nearest;
}

void check_complete(const SimplifiedMesh& simplified, const MapMesh& map) {
  REQUIRE(simplified.node_of_vertex.size() == map.mesh.vertices.size());
  for (const std::uint32_t node : simplified.node_of_vertex) CHECK(node < simplified.nodes.size());
}

}  // namespace

TEST_CASE("Nodes spread over flat surface at about the spacing") {
  const SheetSize size{.columns = 200, .rows = 100, .step_m = 0.1, .keyframe_step_m = 0.5};
  const MapMesh map = sheet(size);  // 20 m x 10 m
  const SimplifiedMesh simplified = simplify(map, kScale);
  check_complete(simplified, map);
  const auto count = static_cast<double>(simplified.nodes.size());
  CHECK(count > 0.7 * 200.0 / 0.866);  // a triangular lattice of 1 m
  CHECK(count < 1.3 * 200.0 / 0.866);
  for (std::size_t n = 0; n < simplified.nodes.size(); ++n) {
    CHECK(nearest_other_m(simplified.nodes, n) >= 0.5);
    CHECK(nearest_other_m(simplified.nodes, n) < 2.0);
  }
  for (std::size_t v = 0; v < map.mesh.vertices.size(); ++v) {
    const MeshNode& node = simplified.nodes[simplified.node_of_vertex[v]];
    CHECK((node.position - map.mesh.vertices[v].cast<double>()).norm() < 3.0);
  }
}

TEST_CASE("Surfaces of distant times have separate nodes and no common edge") {
  MapMesh map = sheet({.columns = 40, .rows = 40, .step_m = 0.1, .keyframe_step_m = 10.0});
  MapMesh again = map;  // the same place on a later visit, 5 cm above, joined along one border
  for (auto& vertex : again.mesh.vertices) vertex.z() += 0.05F;
  for (auto& seen : again.seen_by) seen = {500, 510};
  const auto offset = static_cast<std::uint32_t>(map.mesh.vertices.size());
  map.mesh.append(again.mesh);
  map.seen_by.insert(map.seen_by.end(), again.seen_by.begin(), again.seen_by.end());
  map.ids.clear();
  for (std::uint32_t j = 0; j < 40; ++j) map.mesh.faces.push_back({j + 1, j, offset + j});

  const SimplifiedMesh simplified = simplify(map, kScale);
  check_complete(simplified, map);
  for (std::size_t v = 0; v < map.mesh.vertices.size(); ++v)
    CHECK(keyframe_gap(simplified.nodes[simplified.node_of_vertex[v]].seen_by, map.seen_by[v]) <=
          kScale.max_gap_keyframes);
  for (const auto& [a, b] : region_edges(simplified, map.mesh.faces, kScale.max_gap_keyframes))
    CHECK(keyframe_gap(simplified.nodes[a].seen_by, simplified.nodes[b].seen_by) <=
          kScale.max_gap_keyframes);
}

TEST_CASE("Faces that form no manifold are decimated too") {
  const auto seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> coordinate(0.0, 4.0);
  std::uniform_int_distribution<std::uint32_t> corner(0, 59);
  TimedTriangles soup;
  for (int i = 0; i < 60; ++i) {
    const double x = coordinate(rng);
    const double y = coordinate(rng);
    soup.points.emplace_back(x, y, coordinate(rng));
    soup.seen_by.push_back({0, 0});
  }
  while (soup.faces.size() < 150) {
    const std::uint32_t a = corner(rng);
    const std::uint32_t b = corner(rng);
    const std::uint32_t c = corner(rng);
    if (a != b && b != c && c != a) soup.faces.push_back({a, b, c});
  }
  const CollapsedPoints collapsed = collapse_edges(soup, 20, 0);
  REQUIRE(collapsed.kept_of.size() == soup.points.size());
  for (const std::uint32_t kept : collapsed.kept_of) CHECK(kept < collapsed.kept.size());
  for (const std::uint32_t point : collapsed.kept) CHECK(point < soup.points.size());
}

TEST_CASE("Vertices without faces have nodes, and an empty mesh has none") {
  MapMesh map;
  CHECK(simplify(map, kScale).nodes.empty());
  map.mesh.vertices = {{0, 0, 0}, {0.1F, 0, 0}, {5, 0, 0}};
  map.seen_by.assign(3, {0, 0});
  const SimplifiedMesh simplified = simplify(map, kScale);
  CHECK(simplified.nodes.size() == 2);
  check_complete(simplified, map);
}

}  // namespace km
