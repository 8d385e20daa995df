#include <catch2/catch.hpp>
#include <vector>

#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"

namespace km {
namespace {

std::vector<MeshChunk> chunks_of(RobotId robot, std::uint64_t boot, std::uint32_t side = 60,
                                 RobotId anchor = 0) {
  std::vector<MeshChunk> chunks = split_mesh(wavy_sheet(side, 0.1), robot, anchor, {}).chunks;
  for (MeshChunk& chunk : chunks) chunk.boot = boot;
  return chunks;
}

void add_all(TeamMesh& team, const std::vector<MeshChunk>& chunks) {
  for (const MeshChunk& chunk : chunks) REQUIRE(team.add(chunk) == ChunkVerdict::kTaken);
}

TEST_CASE("The team's mesh has the newest chunk of each robot and cell", "[mesh]") {
  TeamMesh team;
  CHECK(team.snapshot().empty());
  add_all(team, chunks_of(5, 1));
  add_all(team, chunks_of(2, 1, 40));
  std::vector<RobotMesh> snapshot = team.snapshot();
  REQUIRE(snapshot.size() == 2);
  CHECK(snapshot[0].robot == 2);
  CHECK(snapshot[1].robot == 5);
  CHECK(snapshot[1].mesh.vertices.size() == 61 * 61);
  CHECK(snapshot[1].mesh.faces.size() == 2 * 60 * 60);

  MeshChunk chunk = chunks_of(5, 1).front();
  const std::size_t faces = chunk.faces.size();
  chunk.faces.resize(1);
  CHECK(team.add(chunk) == ChunkVerdict::kTaken);
  CHECK(team.snapshot()[1].mesh.faces.size() == 2 * 60 * 60 - faces + 1);
  CHECK(team.add(MeshChunk{.key = chunk.key, .boot = 1}) == ChunkVerdict::kTaken);  // no more
  snapshot = team.snapshot();
  CHECK(snapshot[1].mesh.faces.size() == 2 * 60 * 60 - faces);
  CHECK(snapshot[1].chunks + 1 == chunks_of(5, 1).size());
}

TEST_CASE("A robot that restarts begins its mesh anew", "[mesh]") {
  TeamMesh team;
  add_all(team, chunks_of(5, 77));
  const std::vector<MeshChunk> fresh = chunks_of(5, 78, 10);
  add_all(team, fresh);
  CHECK(team.snapshot()[0].mesh.vertices.size() == 11 * 11);
  CHECK(team.add(chunks_of(5, 77).front()) == ChunkVerdict::kEarlierBoot);
  CHECK(team.snapshot()[0].mesh.vertices.size() == 11 * 11);
}

TEST_CASE("Chunks in the frame of an earlier anchor are left out until they come anew", "[mesh]") {
  TeamMesh team;
  const std::vector<MeshChunk> before = chunks_of(5, 1, 60, 5), after = chunks_of(5, 1, 60, 0);
  add_all(team, before);
  add_all(team, {after.front()});
  RobotMesh mesh = team.snapshot()[0];
  CHECK(mesh.anchor == 0);
  CHECK(mesh.chunks == 1);
  CHECK(mesh.outdated_chunks == before.size() - 1);
  CHECK(mesh.mesh.faces.size() == after.front().faces.size());
  add_all(team, after);
  mesh = team.snapshot()[0];
  CHECK(mesh.outdated_chunks == 0);
  CHECK(mesh.mesh.vertices.size() == 61 * 61);
}

TEST_CASE("A robot cannot send more than there is room for", "[mesh]") {
  MeshChunk chunk = chunks_of(5, 1, 10).front();
  TeamMesh team(10 * wire_bytes(chunk) + 1);
  for (std::int32_t i = 0; i < 10; ++i) {
    chunk.key.cell[0] = i;
    REQUIRE(team.add(chunk) == ChunkVerdict::kTaken);
  }
  chunk.key.cell[0] = -1;
  CHECK(team.add(chunk) == ChunkVerdict::kNoRoom);
  chunk.key.cell[0] = 0;
  CHECK(team.add(chunk) == ChunkVerdict::kTaken);  // in place of the one before
  CHECK(team.add(chunks_of(6, 1, 10).front()) == ChunkVerdict::kTaken);
}

}  // namespace
}  // namespace km
