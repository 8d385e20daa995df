#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>

#include "modules/mesh/mesh_chunks.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"

namespace km {
namespace {

using Catch::Matchers::Contains;

constexpr ChunkGrid kGrid{.cell_m = 2.0, .step_m = 0.001};
// Half a step, and the rounding of a float below 16 m.
constexpr double kRounding_m = 0.5 * 0.001 + 1e-6;

LabelledMesh assembled(const std::vector<MeshChunk>& chunks) {
  std::vector<const MeshChunk*> pointers;
  for (const MeshChunk& chunk : chunks) pointers.push_back(&chunk);
  return assemble_mesh(pointers);
}

// Faces by the positions of their corners in steps, lowest first, with their labels.
using Corner = std::tuple<long, long, long, int>;
std::multiset<std::array<Corner, 3>> faces_in_space(const LabelledMesh& mesh) {
  std::multiset<std::array<Corner, 3>> result;
  for (const auto& face : mesh.faces) {
    std::array<Corner, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d p = mesh.vertices[face[i]].cast<double>() / kGrid.step_m;
      corners[i] = {std::lround(p.x()), std::lround(p.y()), std::lround(p.z()),
                    mesh.labels.empty() ? 0 : mesh.labels[face[i]]};
    }
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    result.insert(corners);
  }
  return result;
}

std::string refusal(const LabelledMesh& mesh, const ChunkGrid& grid = kGrid) {
  try {
    (void)split_mesh(mesh, 1, 1, grid);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

TEST_CASE("The chunks of a mesh are the mesh", "[mesh]") {
  const bool labelled = GENERATE(true, false);
  LabelledMesh mesh = wavy_sheet(150, 0.1);
  if (!labelled) mesh.labels.clear();
  const MeshPieces pieces = split_mesh(mesh, 3, 1, kGrid);
  CHECK(pieces.oversized_faces == 0);
  CHECK(pieces.chunks.size() > 64);
  CHECK(std::ranges::is_sorted(pieces.chunks, {}, &MeshChunk::key));
  for (const MeshChunk& chunk : pieces.chunks) {
    CHECK(chunk.key.robot == 3);
    CHECK(chunk.anchor == 1);
    CHECK(chunk.labels.size() == (labelled ? chunk.offsets.size() : 0));
  }
  const LabelledMesh again = assembled(pieces.chunks);
  CHECK(again.vertices.size() == mesh.vertices.size());  // those on borders coincide
  CHECK(faces_in_space(again) == faces_in_space(mesh));
}

TEST_CASE("A position is off by half a step per axis at most", "[mesh]") {
  const auto seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> metres(-10.0F, 10.0F);
  LabelledMesh mesh;
  for (std::uint32_t f = 0; f < 100; ++f) {
    Eigen::Vector3f center;
    for (float& c : center) c = metres(rng);
    for (int corner = 0; corner < 3; ++corner) {
      Eigen::Vector3f vertex;
      for (int axis = 0; axis < 3; ++axis) vertex[axis] = center[axis] + 0.1F * metres(rng);
      mesh.vertices.push_back(vertex);
    }
    mesh.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  const MeshPieces pieces = split_mesh(mesh, 1, 1, kGrid);
  const LabelledMesh rounded = assembled(pieces.chunks);
  double largest_m = 0.0;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3f& other : rounded.vertices)
      nearest_m = std::min<double>(nearest_m, (vertex - other).cwiseAbs().maxCoeff());
    largest_m = std::max(largest_m, nearest_m);
  }
  CHECK(largest_m < kRounding_m);
}

TEST_CASE("A cell that is too full is sent in parts that fit", "[mesh]") {
  const LabelledMesh mesh = wavy_sheet(180, 0.01);  // 1.8 m: four cells, 16 000 faces each
  const MeshPieces pieces = split_mesh(mesh, 1, 1, kGrid);
  std::map<std::array<std::int32_t, 3>, std::uint16_t> parts;
  for (const MeshChunk& chunk : pieces.chunks) {
    CHECK(wire_bytes(chunk) <= kMaxChunkBytes);
    CHECK(chunk.key.part == parts[chunk.key.cell]++);
  }
  for (const auto& [cell, count] : parts) CHECK(count > 3);
  CHECK(faces_in_space(assembled(pieces.chunks)) == faces_in_space(mesh));
}

TEST_CASE("What did not change gives the same chunks", "[mesh]") {
  const LabelledMesh mesh = wavy_sheet(100, 0.1);
  const MeshPieces before = split_mesh(mesh, 1, 1, kGrid);
  SECTION("in another order of faces and corners") {
    LabelledMesh shuffled = mesh;
    std::mt19937 rng(5);
    std::shuffle(shuffled.faces.begin(), shuffled.faces.end(), rng);
    for (auto& face : shuffled.faces) std::ranges::rotate(face, face.begin() + 1);
    CHECK(split_mesh(shuffled, 1, 1, kGrid).chunks == before.chunks);
  }
  SECTION("elsewhere, with vertices before that are new") {
    LabelledMesh changed;
    changed.append(wavy_sheet(1, 0.1));
    for (auto& vertex : changed.vertices) vertex += Eigen::Vector3f(101.0F, 1.0F, 1.0F);
    changed.append(mesh);
    const MeshPieces after = split_mesh(changed, 1, 1, kGrid);
    std::size_t fresh = 0;
    for (const MeshChunk& chunk : after.chunks)
      if (std::ranges::find(before.chunks, chunk) == before.chunks.end()) ++fresh;
    CHECK(after.chunks.size() == before.chunks.size() + fresh);
    CHECK(fresh == 1);
  }
}

TEST_CASE("Chunks differ by what a viewer would see", "[mesh]") {
  const LabelledMesh mesh = wavy_sheet(10, 0.1);
  const auto chunk_of = [](const LabelledMesh& m) { return split_mesh(m, 1, 1, {}).chunks.at(0); };
  const MeshChunk before = chunk_of(mesh);
  MeshChunk after = before;
  CHECK_FALSE(differ(before, after, 0.0));
  SECTION("a vertex") {
    after.offsets.at(3)[1] = static_cast<std::uint16_t>(after.offsets.at(3)[1] + 5);
    CHECK(differ(before, after, 0.004));
    CHECK_FALSE(differ(before, after, 0.006));
  }
  SECTION("the lowest vertex: the origin") {
    LabelledMesh moved = mesh;
    for (auto& vertex : moved.vertices) vertex.x() += 0.005F;
    after = chunk_of(moved);
    CHECK(differ(before, after, 0.003));
    CHECK_FALSE(differ(before, after, 0.007));
  }
  SECTION("a label") {
    after.labels.at(0) = 77;
    CHECK(differ(before, after, 1.0));
  }
  SECTION("a face") {
    after.faces.pop_back();
    CHECK(differ(before, after, 1.0));
  }
  SECTION("the frame") {
    after.anchor = 9;
    CHECK(differ(before, after, 1.0));
  }
}

TEST_CASE("Faces between negative and positive cells belong to one cell each", "[mesh]") {
  LabelledMesh mesh;
  mesh.vertices = {{-0.3F, 0.1F, 0.1F},   {0.1F, 0.1F, 0.1F},    {0.1F, 0.3F, 0.1F},
                   {-1.9F, -1.9F, -0.1F}, {-2.2F, -1.9F, -0.1F}, {-2.1F, -2.3F, -0.1F}};
  mesh.faces = {{0, 1, 2}, {3, 4, 5}};
  const MeshPieces pieces = split_mesh(mesh, 1, 1, kGrid);
  REQUIRE(pieces.chunks.size() == 2);
  CHECK(pieces.chunks[0].key.cell == std::array<std::int32_t, 3>{-2, -2, -1});
  CHECK(pieces.chunks[1].key.cell == std::array<std::int32_t, 3>{-1, 0, 0});
}

TEST_CASE("A mesh that cannot be sent is refused, a face that is too long left out", "[mesh]") {
  LabelledMesh mesh = wavy_sheet(2, 0.1);
  CHECK(split_mesh({}, 1, 1, kGrid).chunks.empty());
  SECTION("a face longer than the range of offsets") {
    mesh.vertices.back().x() = 30.0F;
    const MeshPieces pieces = split_mesh(mesh, 1, 1, kGrid);
    CHECK(pieces.oversized_faces == 2);
    CHECK(assembled(pieces.chunks).faces.size() == mesh.faces.size() - 2);
  }
  SECTION("a vertex that is not finite") {
    mesh.vertices[3].y() = std::numeric_limits<float>::quiet_NaN();
    CHECK_THAT(refusal(mesh), Contains("vertex 3"));
  }
  SECTION("a vertex beyond all bounds") {
    mesh.vertices[3].y() = 1e9F;
    CHECK_THAT(refusal(mesh), Contains("vertex 3"));
  }
  SECTION("a face without its vertex") {
    mesh.faces[1][2] = 9;
    CHECK_THAT(refusal(mesh), Contains("face 1 names vertex 9 of 9"));
  }
  SECTION("labels of other vertices") {
    mesh.labels.pop_back();
    CHECK_THAT(refusal(mesh), Contains("8 labels for 9 vertices"));
  }
  SECTION("a grid without size") {
    CHECK_THAT(refusal(mesh, {.cell_m = 2.0, .step_m = 0.0}), Contains("cells of 2"));
    CHECK_THAT(refusal(mesh, {.cell_m = 1e6, .step_m = 0.001}), Contains("cells of 1000000"));
  }
}

}  // namespace
}  // namespace km
