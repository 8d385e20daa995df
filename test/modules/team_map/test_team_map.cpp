#include "modules/mesh/team_mesh.hpp"
#include "modules/team_map/team_map.hpp"
#include "test/support/grid_mesh.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr float kMapVoxel_m = 0.05F;

// Waves over a floor of 4 m x 3 m, from x = `from_m` on, lifted by `lift_m`.
LabelledMesh floor_from(float from_m, float lift_m, LabelId label = 1) {
  LabelledMesh mesh = grid_mesh(80, 80, [&](std::size_t i, std::size_t j) {
    const float x = from_m + 0.05F * static_cast<float>(i), y = 0.0375F * static_cast<float>(j);
    return Eigen::Vector3f(x, y, lift_m + 0.2F * std::sin(x) * std::cos(y));
  });
  mesh.labels.assign(mesh.vertices.size(), label);
  return mesh;
}

std::vector<MeshChunk> chunks_of(const LabelledMesh& mesh, RobotId robot, std::uint64_t boot = 1,
                                 RobotId anchor = 0) {
  std::vector<MeshChunk> chunks = split_mesh(mesh, robot, anchor, {}).chunks;
  for (MeshChunk& chunk : chunks) {
    chunk.boot = boot;
    chunk.voxel_m = kMapVoxel_m;
  }
  return chunks;
}

LabelledMesh fused(const TeamMesh& team) {
  return fuse_chunks(team.placed()).mesh;
}

void add_all(TeamMesh& team, const std::vector<MeshChunk>& chunks) {
  for (const MeshChunk& chunk : chunks) CHECK(team.add(chunk) == ChunkVerdict::kTaken);
}

double area_of(const LabelledMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.faces)
    area +=
        0.5 *
        std::abs(
            (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).z());
  return area;
}

bool are_equal(const LabelledMesh& a, const LabelledMesh& b) {
  return a.vertices == b.vertices && a.labels == b.labels && a.faces == b.faces;
}

}  // namespace

TEST_CASE("Copies of a floor are fused between them, and every part is there once") {
  TeamMesh team;
  add_all(team, chunks_of(floor_from(0.0F, 0.0F), 0));
  add_all(team, chunks_of(floor_from(2.0F, 0.04F), 1));
  const LabelledMesh mesh = fused(team);
  CHECK(area_of(mesh) == Approx(6.0 * 3.0).epsilon(0.03));
  for (const Eigen::Vector3f& p : mesh.vertices) {
    const float height = p.z() - 0.2F * std::sin(p.x()) * std::cos(p.y());
    const float expected = p.x() < 1.8F ? 0.0F : p.x() < 4.2F ? 0.02F : 0.04F;
    const bool near_border = std::abs(p.x() - 2.0F) < 0.2F || std::abs(p.x() - 4.0F) < 0.2F ||
                             std::abs(p.y() - 1.5F) > 1.4F;
    if (!near_border) CHECK(height == Approx(expected).margin(3e-3));
  }
}

TEST_CASE("The fused map has the colours of its chunks, and the median of their voxels") {
  TeamMesh team;
  for (RobotId robot = 0; robot < 3; ++robot) {
    LabelledMesh floor = floor_from(0.0F, 0.0F);
    floor.colors.assign(floor.vertices.size(), {static_cast<std::uint8_t>(80 * robot), 200, 40});
    for (MeshChunk chunk : chunks_of(floor, robot)) {
      chunk.voxel_m = std::array{0.04F, 0.1F, 0.12F}[robot];
      CHECK(team.add(chunk) == ChunkVerdict::kTaken);
    }
  }
  const LabelledMesh mesh = fused(team);
  CHECK(mesh.faces.size() > 2000);  // 2400, two in each square of 0.1 m, and some more on slopes
  CHECK(mesh.faces.size() < 4800);
  REQUIRE(mesh.colors.size() == mesh.vertices.size());
  for (const auto& [red, green, blue] : mesh.colors) {
    CHECK(std::abs(red - 80) <= 8);  // five bits
    CHECK(std::abs(green - 200) <= 4);
    CHECK(std::abs(blue - 40) <= 8);
  }
}

TEST_CASE("Surface from larger voxels is there only where there is none from smaller ones") {
  TeamMesh team;
  add_all(team, chunks_of(floor_from(0.0F, 0.0F), 0));
  LabelledMesh mesh = floor_from(4.0F, 0.0F);  // a map with both sizes
  MeshOrigin origin{.seen_by = {}, .T_world_kf = {SE3::Identity()}, .voxel_m = kMapVoxel_m};
  origin.levels.assign(mesh.vertices.size(), 0);
  mesh.append(resampled(floor_from(2.0F, 0.1F, 2), 4.0 * kMapVoxel_m));
  origin.levels.resize(mesh.vertices.size(), 2);
  origin.seen_by.resize(mesh.vertices.size());
  origin.mapped = mesh.vertices;
  add_all(team, split_mesh(mesh, 1, 0, {}, &origin).chunks);
  CHECK(area_of(fused(team)) == Approx(8.0 * 3.0).epsilon(0.03));
}

TEST_CASE("Chunks in another frame than most are left out and counted") {
  TeamMesh alone, team;
  for (TeamMesh* both : {&alone, &team}) add_all(*both, chunks_of(floor_from(0.0F, 0.0F), 1, 1, 1));
  const std::vector<MeshChunk> apart = chunks_of(floor_from(0.0F, 1.0F), 2, 1, 0);
  CHECK(team.add(apart.front()) == ChunkVerdict::kTaken);
  const TeamMap map = fuse_chunks(team.placed());
  CHECK(map.anchor == 1);
  CHECK(map.other_frames == 1);
  CHECK(are_equal(map.mesh, fused(alone)));
  add_all(team, chunks_of(floor_from(0.0F, 1.0F), 2, 1, 1));
  CHECK(fused(team).faces.size() > map.mesh.faces.size());
}

TEST_CASE("A face of a size that no mapper makes is left out") {
  MeshChunk chunk;
  chunk.key = {1, {0, 0, 0}, 0};
  chunk.step_m = 0.01F;
  chunk.offsets = {{0, 0, 0}, {65535, 0, 0}, {0, 65535, 65535}};
  chunk.faces = {{0, 1, 2}};
  CHECK(fuse_chunks({place(chunk, nullptr)}).mesh.empty());
  CHECK(fuse_chunks({}).mesh.empty());
}

TEST_CASE("A robot with many chunks does not decide the frame of three") {
  TeamMesh team;
  add_all(team, {chunks_of(floor_from(0.0F, 0.0F), 1, 1, 1).front(),
                 chunks_of(floor_from(0.0F, 0.0F), 2, 1, 1).front()});
  add_all(team, chunks_of(floor_from(0.0F, 1.0F), 0, 1, 0));
  const TeamMap map = fuse_chunks(team.placed());
  CHECK(map.anchor == 1);
  CHECK(map.extents.size() == 2);
}

TEST_CASE("A robot with too many boxes loses its own") {
  TeamMesh alone, team;
  for (TeamMesh* both : {&alone, &team}) add_all(*both, chunks_of(floor_from(0.0F, 0.0F), 5));
  const LabelledMesh whole = fused(alone);
  for (const float from_m : {-80.0F, -70.0F, 70.0F, 80.0F})
    add_all(team, chunks_of(floor_from(from_m, 0.0F), static_cast<RobotId>(from_m > 0.0F ? 9 : 1)));
  const TeamMap all = fuse_chunks(team.placed());
  CHECK(all.left_out == 0);
  const TeamMap map = fuse_chunks(team.placed(), 80);
  CHECK(map.left_out > 0);
  CHECK(map.mesh.faces.size() < all.mesh.faces.size());
  const auto is_whole_part = [](const LabelledMesh& mesh, const LabelledMesh::Face& face) {
    return std::abs(mesh.vertices[face[0]].x()) < 10.0F;
  };
  CHECK(std::ranges::count_if(map.mesh.faces, [&](const auto& face) {
          return is_whole_part(map.mesh, face);
        }) == static_cast<std::ptrdiff_t>(whole.faces.size()));
}

TEST_CASE("The plan of a map leaves out a robot far away") {
  const auto extent = [](float from_m, float size_m) {
    return Eigen::AlignedBox3f(Eigen::Vector3f::Constant(from_m),
                               Eigen::Vector3f::Constant(from_m + size_m));
  };
  using Extents = std::map<RobotId, Eigen::AlignedBox3f>;
  const auto [liar, far] = GENERATE_REF(table<RobotId, Eigen::AlignedBox3f>(
      {{0, extent(1e6F, 1.0F)}, {4, extent(1e6F, 1.0F)}, {2, extent(-5e5F, 1e6F)}}));
  Extents extents{{1, extent(0.0F, 20.0F)}, {3, extent(15.0F, 20.0F)}};
  extents[liar] = far;
  const Eigen::AlignedBox2f plan = plan_of(extents, 0.05, 16e6);
  CHECK(plan.min() == Eigen::Vector2f(0.0F, 0.0F));
  CHECK(plan.max() == Eigen::Vector2f(35.0F, 35.0F));
  CHECK(plan_of({{1, extent(0.0F, 1e6F)}}, 0.05, 16e6).isEmpty());
}

TEST_CASE("A mesh in larger voxels has the same shape with fewer faces") {
  const LabelledMesh fine = floor_from(0.0F, 0.0F), coarse = resampled(fine, 0.2);
  CHECK(10 * coarse.faces.size() < fine.faces.size());
  REQUIRE_FALSE(coarse.empty());
  for (const Eigen::Vector3f& p : coarse.vertices)
    if (p.x() > 0.3F && p.x() < 3.7F && p.y() > 0.3F && p.y() < 2.7F)
      CHECK(p.z() == Approx(0.2F * std::sin(p.x()) * std::cos(p.y())).margin(5e-3));
}

}  // namespace km
