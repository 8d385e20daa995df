#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <memory>
#include <utility>

#include "test/modules/semantic_mapping/filled_blocks.hpp"

namespace km {
namespace {

// A plane seen on two visits, as the blocks of each leave the map.
struct PlaneTwice {
  static constexpr double kFirst_m = 0.05, kSecond_m = 0.07;

  PlaneTwice() {
    see(kFirst_m, 1, 3);
    leave();
    first = mesh.snapshot(map, true);
    see(kSecond_m, 2, 2);
  }

  void see(double height_m, LabelId label, unsigned votes) {
    fill(map, 1, [&](const Eigen::Vector3d& p) { return p.z() - height_m; });
    VoxelLabels labels;
    labels.observe(label, votes);
    for (const auto& block : map.blocks()) {
      block->labels = std::make_unique<std::array<VoxelLabels, kBlockVoxels>>();
      block->labels->fill(labels);
    }
    mesh.update(map);
  }
  void leave() {
    std::vector<VoxelBlock*> blocks;
    for (const auto& block : map.blocks()) blocks.push_back(block.get());
    (void)mesh.finalise(blocks, map);
    while (map.size() > 0) map.erase(Eigen::Vector3i(map.blocks().back()->position));
  }
  // Each vertex of the first visit, with that of the second above it.
  [[nodiscard]] SupersededSurface superseded() const {
    const MapMesh both = mesh.snapshot(map, false);
    std::map<std::pair<float, float>, std::uint64_t> above;
    for (std::size_t v = 0; v < both.ids.size(); ++v) {
      const Eigen::Vector3f& p = both.mesh.vertices[v];
      if (p.z() > 0.06F) above[{p.x(), p.y()}] = both.ids[v];
    }
    SupersededSurface surface;
    for (std::size_t v = 0; v < first.ids.size(); ++v) {
      const Eigen::Vector3f& p = first.mesh.vertices[v];
      surface.vertices.push_back({first.ids[v], above.at({p.x(), p.y()})});
    }
    return surface;
  }

  BlockMap map;
  IncrementalMesh mesh = new_mesh();
  MapMesh first;
};

TEST_CASE("Superseded final surface goes, and its labels vote on", "[semantic_mapping]") {
  PlaneTwice plane;
  const std::size_t faces = plane.first.mesh.faces.size(), vertices = plane.first.ids.size();
  REQUIRE(plane.mesh.face_count() == 2 * faces);
  const SupersededSurface superseded = plane.superseded();

  SECTION("not before that which supersedes it is final too") {
    CHECK(plane.mesh.drop(superseded).faces == 0);
    CHECK(plane.mesh.face_count() == 2 * faces);
  }
  SECTION("once, and never what is not listed") {
    plane.leave();
    const SurfaceDrop dropped = plane.mesh.drop(superseded);
    CHECK(dropped.faces == faces);
    CHECK(dropped.vertices == vertices);
    CHECK(plane.mesh.face_count() == faces);
    CHECK(plane.mesh.final_face_count() == faces);
    const MapMesh left = plane.mesh.snapshot(plane.map, true);
    REQUIRE(left.ids.size() == vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
      CHECK(left.mesh.vertices[v].z() == Approx(PlaneTwice::kSecond_m));
      CHECK(left.mesh.labels[v] == 1);  // three votes of the first visit to two
    }
    CHECK(plane.mesh.drop(superseded).faces == 0);
  }
  SECTION("a face goes with its last vertex") {
    plane.leave();
    SupersededSurface all_but_one = superseded;
    const std::uint64_t left_out = superseded.vertices[vertices / 2].id;
    std::erase_if(all_but_one.vertices, [&](const auto& v) { return v.id == left_out; });
    std::size_t around = 0;
    for (const auto& face : plane.first.mesh.faces)
      for (const std::uint32_t v : face) around += plane.first.ids[v] == left_out ? 1 : 0;
    REQUIRE(around >= 4);
    CHECK(plane.mesh.drop(all_but_one).faces == faces - around);
    // Those that stay have voted nowhere: the heirs next to them know the second visit only.
    const MapMesh left = plane.mesh.snapshot(plane.map, true);
    std::size_t stayed = 0;
    for (std::size_t v = 0; v < left.ids.size(); ++v) {
      stayed += left.mesh.vertices[v].z() < 0.06F ? 1 : 0;
      if (left.mesh.labels[v] == 2) CHECK(left.mesh.vertices[v].z() > 0.06F);
    }
    CHECK(stayed == left.ids.size() - vertices);
    CHECK(std::count(left.mesh.labels.begin(), left.mesh.labels.end(), LabelId{2}) ==
          static_cast<std::ptrdiff_t>(stayed));
    CHECK(plane.mesh.drop(superseded).faces == around);
  }
  SECTION("places of what is gone are used again") {
    plane.leave();
    (void)plane.mesh.drop(superseded);
    plane.see(0.03, 2, 1);
    const MapMesh seen = plane.mesh.snapshot(plane.map, true);
    CHECK(seen.ids.size() == 2 * vertices);
    CHECK(seen.ids[vertices] > superseded.vertices.back().heir);  // names are not
  }
}

}  // namespace
}  // namespace km
