#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "modules/team_map/team_map.hpp"

namespace km {
namespace {

constexpr double kMapVoxel_m = 0.05;

// Waves over a floor of 4 m x 3 m, from x = `from_m` on, lifted by `lift_m`.
LabelledMesh floor_from(float from_m, float lift_m, LabelId label = 1) {
  constexpr int kCells = 80;
  LabelledMesh mesh;
  for (int y = 0; y <= kCells; ++y)
    for (int x = 0; x <= kCells; ++x) {
      const float px = from_m + 0.05F * static_cast<float>(x), py = 0.0375F * static_cast<float>(y);
      mesh.vertices.emplace_back(px, py, lift_m + 0.2F * std::sin(px) * std::cos(py));
      mesh.labels.push_back(label);
    }
  for (std::uint32_t y = 0; y < kCells; ++y)
    for (std::uint32_t x = 0; x < kCells; ++x) {
      const std::uint32_t a = x + (kCells + 1) * y, b = a + kCells + 1;
      mesh.faces.push_back({a, a + 1, b + 1});
      mesh.faces.push_back({a, b + 1, b});
    }
  return mesh;
}

std::vector<MeshChunk> chunks_of(const LabelledMesh& mesh, RobotId robot, std::uint64_t boot = 1,
                                 RobotId anchor = 0) {
  std::vector<MeshChunk> chunks = split_mesh(mesh, robot, anchor, {}).chunks;
  for (MeshChunk& chunk : chunks) chunk.boot = boot;
  return chunks;
}

void add_all(TeamMap& map, const std::vector<MeshChunk>& chunks) {
  for (const MeshChunk& chunk : chunks) CHECK(map.add(chunk) == ChunkVerdict::kTaken);
}

LabelledMesh fused(TeamMap& map) {
  map.update();
  return map.mesh();
}

bool are_equal(const LabelledMesh& a, const LabelledMesh& b) {
  return a.vertices == b.vertices && a.labels == b.labels && a.faces == b.faces;
}

}  // namespace

TEST_CASE("Robots with the same chunks have the same map, in whatever order they came",
          "[team_map]") {
  std::vector<MeshChunk> chunks;
  for (const RobotId robot : {RobotId{0}, RobotId{1}, RobotId{2}})
    for (MeshChunk& chunk : chunks_of(floor_from(robot, 0.01F * robot), robot))
      chunks.push_back(std::move(chunk));
  TeamMap first(kMapVoxel_m), second(kVoxel_m);
  add_all(first, chunks_of(floor_from(0.3F, 0.3F), 1));  // replaced later
  add_all(first, chunks);
  const LabelledMesh expected = fused(first);
  std::mt19937 rng(3);
  for (std::size_t k = 0; k < chunks.size(); k += 10) {
    std::shuffle(chunks.begin(), chunks.end(), rng);
    second.add(chunks.front());
    second.update();
  }
  add_all(second, chunks);
  // Robot 1 takes back the chunks that only its first mesh had.
  std::vector<MeshChunk> gone = chunks_of(floor_from(0.3F, 0.3F), 1);
  for (MeshChunk& chunk : gone) {
    const bool stays =
        std::ranges::any_of(chunks, [&](const MeshChunk& other) { return other.key == chunk.key; });
    if (stays) continue;
    chunk.offsets.clear(), chunk.labels.clear(), chunk.faces.clear();
    CHECK(first.add(chunk) == ChunkVerdict::kTaken);
  }
  CHECK(are_equal(fused(first), fused(second)));
  CHECK(expected.faces.size() > 1000);
}

TEST_CASE("Copies of a floor are fused between them, and every part is there once", "[team_map]") {
  TeamMap map(kMapVoxel_m);
  add_all(map, chunks_of(floor_from(0.0F, 0.0F), 0));
  add_all(map, chunks_of(floor_from(2.0F, 0.04F), 1));
  const LabelledMesh mesh = fused(map);
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.faces)
    area +=
        0.5 *
        std::abs(
            (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).z());
  CHECK(area == Approx(6.0 * 3.0).epsilon(0.03));
  for (const Eigen::Vector3f& p : mesh.vertices) {
    const float height = p.z() - 0.2F * std::sin(p.x()) * std::cos(p.y());
    const float expected = p.x() < 1.8F ? 0.0F : p.x() < 4.2F ? 0.02F : 0.04F;
    const bool near_border = std::abs(p.x() - 2.0F) < 0.2F || std::abs(p.x() - 4.0F) < 0.2F ||
                             std::abs(p.y() - 1.5F) > 1.4F;
    if (!near_border) CHECK(height == Approx(expected).margin(3e-3));
  }
}

TEST_CASE("A robot that restarts loses its former surface, and others keep theirs", "[team_map]") {
  TeamMap map(kMapVoxel_m);
  const std::vector<MeshChunk> former = chunks_of(floor_from(0.0F, 0.5F), 1, 1);
  add_all(map, chunks_of(floor_from(0.0F, 0.0F), 0));
  add_all(map, former);
  fused(map);
  add_all(map, chunks_of(floor_from(2.0F, 0.5F), 1, 2));
  CHECK(map.add(former.front()) == ChunkVerdict::kEarlierBoot);
  TeamMap expected(kMapVoxel_m);
  add_all(expected, chunks_of(floor_from(0.0F, 0.0F), 0));
  add_all(expected, chunks_of(floor_from(2.0F, 0.5F), 1, 2));
  CHECK(are_equal(fused(map), fused(expected)));
}

TEST_CASE("Chunks in another frame are left out until they are of the team's", "[team_map]") {
  TeamMap map(kMapVoxel_m), expected(kVoxel_m);
  add_all(map, chunks_of(floor_from(0.0F, 0.0F), 0));
  add_all(expected, chunks_of(floor_from(0.0F, 0.0F), 0));
  const std::vector<MeshChunk> apart = chunks_of(floor_from(0.0F, 1.0F), 1, 1, 1);
  CHECK(map.add(apart.front()) == ChunkVerdict::kTaken);
  CHECK(map.anchor() == 0);
  CHECK(are_equal(fused(map), fused(expected)));
  add_all(map, chunks_of(floor_from(0.0F, 1.0F), 1, 1, 0));
  CHECK(fused(map).faces.size() > fused(expected).faces.size());
}

TEST_CASE("A face of a size that no mapper makes is left out", "[team_map]") {
  MeshChunk chunk;
  chunk.key = {1, {0, 0, 0}, 0};
  chunk.boot = 1;
  chunk.step_m = 0.01F;
  chunk.offsets = {{0, 0, 0}, {65535, 0, 0}, {0, 65535, 65535}};
  chunk.faces = {{0, 1, 2}};
  TeamMap map(kMapVoxel_m);
  CHECK(map.add(chunk) == ChunkVerdict::kTaken);
  CHECK(map.waiting() == 0);
  CHECK(fused(map).empty());
}

}  // namespace km
