#include "modules/semantic_mapping/incremental_mesh.hpp"
#include "test/modules/semantic_mapping/mesh_checks.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kVoxel_m = 0.1;

Eigen::Vector3d point_of(const VoxelBlock& block, int x, int y, int z) {
  return kVoxel_m * (kBlockSide * block.position + Eigen::Vector3i(x, y, z)).cast<double>();
}

// Sets all voxels of a block to a distance function, as observed.
template <typename Distance>
void fill(VoxelBlock& block, const Distance& distance) {
  for (int z = 0; z < kBlockSide; ++z)
    for (int y = 0; y < kBlockSide; ++y)
      for (int x = 0; x < kBlockSide; ++x) {
        const std::size_t voxel = voxel_index(x, y, z);
        block.distance[voxel] = static_cast<float>(distance(point_of(block, x, y, z)));
        block.weight[voxel] = 1.0F;
      }
  block.changed = true;
}

// Blocks from -n to n - 1 along each axis, so that many borders pass through the middle.
template <typename Distance>
void fill(BlockMap& map, int n, const Distance& distance) {
  for (int z = -n; z < n; ++z)
    for (int y = -n; y < n; ++y)
      for (int x = -n; x < n; ++x) fill(map.insert({x, y, z}), distance);
}

BlockMap new_map() {
  return {kVoxel_m, {.views = 0}};
}

const Eigen::Vector3d kCentre(0.013, -0.021, 0.037);  // on no grid line

struct Errors {
  double mean = 0.0, largest = 0.0;
};

// Distances of the vertices from the surface [voxels].
template <typename Distance>
Errors errors_of(const LabelledMesh& mesh, const Distance& distance) {
  Errors errors;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    const double error = std::abs(distance(p.cast<double>())) / kVoxel_m;
    errors.mean += error / static_cast<double>(mesh.vertices.size());
    errors.largest = std::max(errors.largest, error);
  }
  return errors;
}

TEST_CASE("The mesh of a sphere is closed across blocks and near the sphere") {
  constexpr double kRadius_m = 1.0;
  const auto sphere = [](const Eigen::Vector3d& p) { return (p - kCentre).norm() - kRadius_m; };
  BlockMap map = new_map();
  fill(map, 2, sphere);
  IncrementalMesh mesh;
  mesh.update(map);
  const LabelledMesh result = mesh.snapshot({&map, 1}, false).mesh;
  CHECK(result.labels.empty());
  REQUIRE(result.vertices.size() > 1000);
  CHECK(rim_of(result).empty());
  // A closed surface of genus 0 without doubled vertices: V - E + F = 2, E = 3 F / 2.
  CHECK(2 * result.vertices.size() == result.faces.size() + 4);
  const Errors errors = errors_of(result, sphere);
  CHECK(errors.mean < 0.1);
  CHECK(errors.largest < 0.2);  // the filter flattens curvature
  // A polyhedron with its corners on the sphere is inside it. It is smaller, by curvature times
  // voxel.
  const double volume = 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius_m, 3);
  CHECK(volume_of(result) < volume);
  CHECK(volume_of(result) > 0.98 * volume);
}

TEST_CASE("The surface has no cracks with any signs") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> draw(-1.0, 1.0);
  BlockMap map = new_map();
  // Noise in the middle, free space around it.
  fill(map, 2, [&](const Eigen::Vector3d& p) {
    const double value = draw(rng);
    return p.cwiseAbs().maxCoeff() < 11.5 * kVoxel_m ? value : 1.0;
  });
  IncrementalMesh mesh;
  mesh.update(map);
  const LabelledMesh result = mesh.snapshot({&map, 1}, false).mesh;
  CHECK(result.faces.size() > 10000);  // all 256 kinds of cells
  CHECK(rim_of(result).empty());
  CHECK(volume_of(result) > 0.0);
}

TEST_CASE("Only changed blocks are meshed again, and vertices keep their identity") {
  double radius_m = 1.0;
  const auto sphere = [&](const Eigen::Vector3d& p) { return (p - kCentre).norm() - radius_m; };
  BlockMap map = new_map();
  fill(map, 2, sphere);
  IncrementalMesh mesh;
  CHECK(mesh.update(map) == 64);
  const MapMesh before = mesh.snapshot({&map, 1}, false);
  CHECK(std::is_sorted(before.ids.begin(), before.ids.end()));

  SECTION("without a change nothing happens") {
    CHECK(mesh.update(map) == 0);
    const MapMesh after = mesh.snapshot({&map, 1}, false);
    CHECK(after.ids == before.ids);
    CHECK(after.mesh.faces == before.mesh.faces);
  }
  SECTION("repeated values give the same vertices") {
    for (const auto& block : map.blocks()) fill(*block, sphere);
    mesh.update(map);
    const MapMesh after = mesh.snapshot({&map, 1}, false);
    CHECK(after.ids == before.ids);
    CHECK(after.mesh.vertices == before.mesh.vertices);
    CHECK(after.mesh.faces == before.mesh.faces);
  }
  SECTION("one block changes: it and the seven below are meshed") {
    VoxelBlock* block = map.find({0, 0, 0});
    REQUIRE(block != nullptr);
    fill(*block, sphere);
    CHECK(mesh.update(map) == 8);
    CHECK(mesh.snapshot({&map, 1}, false).ids == before.ids);
  }
  SECTION("a sphere that grows a little keeps most of its vertices, and stays closed") {
    radius_m = 1.01;
    for (const auto& block : map.blocks()) fill(*block, sphere);
    mesh.update(map);
    const MapMesh after = mesh.snapshot({&map, 1}, false);
    CHECK(rim_of(after.mesh).empty());
    std::vector<std::uint64_t> kept;
    std::set_intersection(before.ids.begin(), before.ids.end(), after.ids.begin(), after.ids.end(),
                          std::back_inserter(kept));
    // A tenth of a voxel: about that share of the grid edges is passed.
    CHECK(kept.size() > before.ids.size() * 8 / 10);
    CHECK(kept.size() < before.ids.size());
  }
}

TEST_CASE("Final mesh stays when its blocks are erased and stays connected with the rest") {
  double radius_m = 1.0;
  const auto sphere = [&](const Eigen::Vector3d& p) { return (p - kCentre).norm() - radius_m; };
  BlockMap map = new_map();
  fill(map, 2, sphere);
  IncrementalMesh mesh;
  mesh.update(map);
  const MapMesh before = mesh.snapshot({&map, 1}, false);
  const std::vector<Eigen::Vector3i> leaving{{0, 0, 0}, {1, 0, 0}, {0, -1, 1}};
  std::vector<VoxelBlock*> blocks;
  for (const Eigen::Vector3i& position : leaving) blocks.push_back(map.find(position));
  CHECK(mesh.finalise(blocks, map) == 0);  // nothing changed since
  for (const Eigen::Vector3i& position : leaving) map.erase(position);
  CHECK(mesh.final_face_count() > 0);

  const MapMesh same = mesh.snapshot({&map, 1}, false);
  CHECK(same.ids == before.ids);
  CHECK(same.mesh.vertices == before.mesh.vertices);
  CHECK(same.mesh.faces.size() == before.mesh.faces.size());
  CHECK(rim_of(same.mesh).empty());

  // The rest is meshed again: the surface is equal and the seam is closed.
  for (const auto& block : map.blocks()) fill(*block, sphere);
  mesh.update(map);
  const MapMesh again = mesh.snapshot({&map, 1}, false);
  CHECK(again.ids == before.ids);
  CHECK(rim_of(again.mesh).empty());

  // One of the blocks returns and is observed again: this adds new vertices.
  fill(map.insert({0, 0, 0}), sphere);
  mesh.update(map);
  const MapMesh revisited = mesh.snapshot({&map, 1}, false);
  CHECK(revisited.ids.size() > before.ids.size());
  CHECK(std::includes(revisited.ids.begin(), revisited.ids.end(), before.ids.begin(),
                      before.ids.end()));
}

TEST_CASE("Unobserved voxels leave a hole, not a wall") {
  const auto plane = [](const Eigen::Vector3d& p) { return p.z() - 0.05; };
  BlockMap map = new_map();
  fill(map, 1, plane);
  map.find({0, 0, 0})->weight[voxel_index(4, 4, 0)] = 0.0F;
  IncrementalMesh mesh;
  mesh.update(map);
  const LabelledMesh result = mesh.snapshot({&map, 1}, false).mesh;
  // 15 x 15 cells of two triangles, without the four around the voxel.
  CHECK(result.faces.size() == 2 * (15 * 15 - 4));
  // Counter-clockwise from free space, above.
  for (const auto& face : result.faces) {
    const Eigen::Vector3f a = result.vertices[face[0]], b = result.vertices[face[1]];
    CHECK((b - a).cross(result.vertices[face[2]] - a).z() > 0.0F);
  }
}

// A plane seen on two visits, as the blocks of each visit leave the map.
struct PlaneTwice {
  static constexpr double kFirst_m = 0.05, kSecond_m = 0.07;

  PlaneTwice() {
    see(kFirst_m, 1, 3);
    leave();
    first = mesh.snapshot({&map, 1}, true);
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
  // Each vertex of the first visit, with the vertex of the second visit above it.
  [[nodiscard]] SupersededSurface superseded() {
    const MapMesh both = mesh.snapshot({&map, 1}, false);
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

  BlockMap map = new_map();
  IncrementalMesh mesh;
  MapMesh first;
};

TEST_CASE("Superseded final surface is dropped and its votes on labels are kept") {
  PlaneTwice plane;
  const std::size_t faces = plane.first.mesh.faces.size(), vertices = plane.first.ids.size();
  REQUIRE(plane.mesh.face_count() == 2 * faces);
  const SupersededSurface superseded = plane.superseded();

  SECTION("not before the superseding surface is final too") {
    CHECK(plane.mesh.drop(superseded).faces == 0);
    CHECK(plane.mesh.face_count() == 2 * faces);
  }
  SECTION("once and only the listed surface") {
    plane.leave();
    const SurfaceDrop dropped = plane.mesh.drop(superseded);
    CHECK(dropped.faces == faces);
    CHECK(dropped.vertices == vertices);
    CHECK(plane.mesh.face_count() == faces);
    CHECK(plane.mesh.final_face_count() == faces);
    const MapMesh left = plane.mesh.snapshot({&plane.map, 1}, true);
    REQUIRE(left.ids.size() == vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
      CHECK(left.mesh.vertices[v].z() == Approx(PlaneTwice::kSecond_m));
      CHECK(left.mesh.labels[v] == 1);  // three votes of the first visit to two
    }
    CHECK(plane.mesh.drop(superseded).faces == 0);
  }
  SECTION("a face is dropped with its last vertex") {
    plane.leave();
    SupersededSurface all_but_one = superseded;
    const std::uint64_t left_out = superseded.vertices[vertices / 2].id;
    std::erase_if(all_but_one.vertices, [&](const auto& v) { return v.id == left_out; });
    std::size_t around = 0;
    for (const auto& face : plane.first.mesh.faces)
      for (const std::uint32_t v : face) around += plane.first.ids[v] == left_out ? 1 : 0;
    REQUIRE(around >= 4);
    CHECK(plane.mesh.drop(all_but_one).faces == faces - around);
    // The remaining vertices got no votes: the replacements next to them know only the second
    // visit.
    const MapMesh left = plane.mesh.snapshot({&plane.map, 1}, true);
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
  SECTION("indices of dropped vertices are reused") {
    plane.leave();
    (void)plane.mesh.drop(superseded);
    plane.see(0.03, 2, 1);
    const MapMesh seen = plane.mesh.snapshot({&plane.map, 1}, true);
    CHECK(seen.ids.size() == 2 * vertices);
    CHECK(seen.ids[vertices] > superseded.vertices.back().replacement);  // ids are not reused
  }
}

}  // namespace
}  // namespace km
