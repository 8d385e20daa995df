#include "modules/mesh/chunk_placement.hpp"
#include "modules/mesh/chunk_schedule.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "test/modules/mesh/assembled_mesh.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr ChunkGrid kGrid{.cell_m = 2.0, .step_m = 0.001};

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

TEST_CASE("The chunks of a mesh contain the whole mesh") {
  const bool labelled = GENERATE(true, false);
  LabelledMesh mesh = wavy_sheet(150, 0.1);
  if (!labelled) mesh.labels.clear();
  const SplitMesh pieces = split_mesh(mesh, 3, 1, kGrid);
  CHECK(pieces.oversized_faces == 0);
  CHECK(pieces.chunks.size() > 64);
  CHECK(std::ranges::is_sorted(pieces.chunks, {}, &MeshChunk::key));
  for (const MeshChunk& chunk : pieces.chunks) {
    CHECK(chunk.key.robot == 3);
    CHECK(chunk.anchor == 1);
    CHECK(chunk.labels.size() == (labelled ? chunk.offsets.size() : 0));
  }
  const LabelledMesh again = assembled(pieces.chunks);
  CHECK(again.vertices.size() == mesh.vertices.size());  // vertices on borders coincide
  CHECK(faces_in_space(again) == faces_in_space(mesh));
}

TEST_CASE("A cell that is too full is sent in several parts") {
  const LabelledMesh mesh = wavy_sheet(180, 0.01);  // 1.8 m: four cells, 16 000 faces each
  const SplitMesh pieces = split_mesh(mesh, 1, 1, kGrid);
  std::map<std::array<std::int32_t, 3>, std::uint16_t> parts;
  for (const MeshChunk& chunk : pieces.chunks) {
    CHECK(plain_bytes(chunk) <= kMaxChunkBytes);
    CHECK(chunk.key.part == parts[chunk.key.cell]++);
  }
  for (const auto& [cell, count] : parts) CHECK(count > 3);
  CHECK(faces_in_space(assembled(pieces.chunks)) == faces_in_space(mesh));
}

TEST_CASE("An unchanged mesh gives the same chunks") {
  const LabelledMesh mesh = wavy_sheet(100, 0.1);
  const SplitMesh before = split_mesh(mesh, 1, 1, kGrid);
  SECTION("in another order of faces and corners") {
    LabelledMesh shuffled = mesh;
    std::mt19937 rng(5);
    std::shuffle(shuffled.faces.begin(), shuffled.faces.end(), rng);
    for (auto& face : shuffled.faces) std::ranges::rotate(face, face.begin() + 1);
    CHECK(split_mesh(shuffled, 1, 1, kGrid).chunks == before.chunks);
  }
  SECTION("elsewhere with new vertices before its own") {
    LabelledMesh changed;
    changed.append(wavy_sheet(1, 0.1));
    for (auto& vertex : changed.vertices) vertex += Eigen::Vector3f(101.0F, 1.0F, 1.0F);
    changed.append(mesh);
    const SplitMesh after = split_mesh(changed, 1, 1, kGrid);
    std::size_t fresh = 0;
    for (const MeshChunk& chunk : after.chunks)
      if (std::ranges::find(before.chunks, chunk) == before.chunks.end()) ++fresh;
    CHECK(after.chunks.size() == before.chunks.size() + fresh);
    CHECK(fresh == 1);
  }
}

TEST_CASE("Chunks differ by differences that a viewer would show") {
  const LabelledMesh mesh = wavy_sheet(10, 0.1);
  const auto chunk_of = [](const LabelledMesh& m) { return split_mesh(m, 1, 1, {}).chunks.at(0); };
  const MeshChunk before = chunk_of(mesh);
  CHECK_FALSE(differ(before, before, 0.0));
  const auto check_change = [&](double sent_m, double kept_m, const auto& change) {
    MeshChunk after = before;
    change(after);
    CHECK(differ(before, after, sent_m));
    if (kept_m > 0.0) CHECK_FALSE(differ(before, after, kept_m));
  };
  check_change(0.004, 0.006, [](auto& chunk) {
    chunk.offsets.at(3)[1] = static_cast<std::uint16_t>(chunk.offsets.at(3)[1] + 5);
  });
  check_change(0.003, 0.007, [&](auto& chunk) {  // the lowest vertex: the origin
    LabelledMesh moved = mesh;
    for (auto& vertex : moved.vertices) vertex.x() += 0.005F;
    chunk = chunk_of(moved);
  });
  check_change(1.0, 0.0, [](auto& chunk) { chunk.labels.at(0) = 77; });
  check_change(1.0, 0.0, [](auto& chunk) { chunk.faces.pop_back(); });
  check_change(1.0, 0.0, [](auto& chunk) { chunk.anchor = 9; });
}

TEST_CASE("A mesh that cannot be sent is refused and a face that is too long is dropped") {
  CHECK(split_mesh({}, 1, 1, kGrid).chunks.empty());
  const LabelledMesh good = wavy_sheet(2, 0.1);
  LabelledMesh mesh = good;
  mesh.vertices.back().x() = 30.0F;
  const SplitMesh pieces = split_mesh(mesh, 1, 1, kGrid);
  CHECK(pieces.oversized_faces == 2);
  CHECK(assembled(pieces.chunks).faces.size() == mesh.faces.size() - 2);

  const auto check_refusal = [&](const char* why, const auto& damage) {
    mesh = good;
    damage(mesh);
    CHECK_THAT(refusal(mesh), Contains(why));
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  check_refusal("vertex 3", [](auto& m) { m.vertices[3].y() = kNan; });
  check_refusal("vertex 3", [](auto& m) { m.vertices[3].y() = 1e9F; });
  check_refusal("face 1 names vertex 9 of 9", [](auto& m) { m.faces[1][2] = 9; });
  check_refusal("8 labels for 9 vertices", [](auto& m) { m.labels.pop_back(); });
  CHECK_THAT(refusal(good, {.cell_m = 2.0, .step_m = 0.0}), Contains("cells of 2"));
  CHECK_THAT(refusal(good, {.cell_m = 1e6, .step_m = 0.001}), Contains("cells of 1000000"));
}

MeshChunk chunk(std::int32_t cell, std::uint16_t height = 0) {
  return {.key = {.robot = 1, .cell = {cell, 0, 0}},
          .offsets = {{0, 0, height}, {1, 0, 0}, {0, 1, 0}},
          .labels = {},
          .faces = {{0, 1, 2}}};
}

// Cells in the order of sending, until nothing is left.
std::vector<std::int32_t> sent_cells(ChunkSchedule& schedule) {
  std::vector<std::int32_t> cells;
  while (const auto next = schedule.next()) cells.push_back(next->key.cell[0]);
  return cells;
}

using Cells = std::vector<std::int32_t>;

TEST_CASE("Moves below the threshold are sent when their sum exceeds it") {
  ChunkSchedule schedule(0.010);  // chunks have steps of 1 mm
  schedule.update({chunk(0)});
  CHECK(sent_cells(schedule) == Cells{0});
  schedule.update({chunk(0, 6)});
  CHECK(sent_cells(schedule).empty());
  schedule.update({chunk(0, 12)});
  CHECK(sent_cells(schedule) == Cells{0});
}

TEST_CASE("Only the newest state of a chunk is sent and only once") {
  ChunkSchedule schedule(0.0);
  schedule.update({chunk(0, 1)});
  schedule.update({chunk(0, 2)});
  schedule.update({chunk(0, 3)});
  const auto sent = schedule.next();
  REQUIRE(sent);
  CHECK(sent->offsets[0][2] == 3);
  CHECK_FALSE(schedule.next());
  schedule.update({chunk(0, 4)});
  schedule.update({chunk(0, 3)});  // changed and changed back before its turn
  CHECK_FALSE(schedule.next());
}

TEST_CASE("A cell that vanished is sent empty once and may return") {
  ChunkSchedule schedule(0.0);
  schedule.update({chunk(0), chunk(1)});
  CHECK(sent_cells(schedule) == Cells{0, 1});
  schedule.update({chunk(1)});
  const auto gone = schedule.next();
  REQUIRE(gone);
  CHECK(gone->key == chunk(0).key);
  CHECK(gone->empty());
  CHECK(gone->offsets.empty());
  schedule.update({chunk(1)});
  CHECK_FALSE(schedule.next());
  schedule.update({chunk(0), chunk(1)});
  CHECK(sent_cells(schedule) == Cells{0});
}

TEST_CASE("After a restart everything is sent again and vanished cells are sent empty") {
  ChunkSchedule schedule(0.0);
  schedule.update({chunk(0), chunk(1), chunk(2)});
  CHECK(sent_cells(schedule) == Cells{0, 1, 2});
  schedule.update({chunk(1), chunk(2)});
  schedule.begin_again();
  CHECK(schedule.waiting() == 0);
  schedule.update({chunk(2), chunk(3)});
  std::map<std::int32_t, bool> is_empty;
  while (const auto next = schedule.next()) is_empty[next->key.cell[0]] = next->empty();
  CHECK(is_empty == std::map<std::int32_t, bool>{{0, true}, {1, true}, {2, false}, {3, false}});
  schedule.update({chunk(2), chunk(3)});
  CHECK_FALSE(schedule.next());
}

TEST_CASE("Every chunk is sent although all change faster than they can be sent") {
  ChunkSchedule schedule(0.0);
  Cells sent;
  for (std::uint16_t version = 1; version <= 10; ++version) {
    std::vector<MeshChunk> all;
    for (std::int32_t cell = 0; cell < 5; ++cell) all.push_back(chunk(cell, version));
    schedule.update(std::move(all));
    for (int i = 0; i < 2; ++i) sent.push_back(schedule.next().value().key.cell[0]);
  }
  for (std::int32_t cell = 0; cell < 5; ++cell) CHECK(std::ranges::count(sent, cell) == 4);
}

std::vector<MeshChunk> chunks_of(RobotId robot, std::uint64_t boot, std::uint32_t side = 60,
                                 RobotId anchor = 0) {
  std::vector<MeshChunk> chunks = split_mesh(wavy_sheet(side, 0.1), robot, anchor, {}).chunks;
  for (MeshChunk& chunk : chunks) chunk.boot = boot;
  return chunks;
}

void add_all(TeamMesh& team, const std::vector<MeshChunk>& chunks) {
  for (const MeshChunk& chunk : chunks) REQUIRE(team.add(chunk) == ChunkVerdict::kTaken);
}

TEST_CASE("The team's mesh has the newest chunk of each robot and cell") {
  TeamMesh team;
  CHECK(team.placed().empty());
  add_all(team, chunks_of(5, 1));
  add_all(team, chunks_of(2, 1, 40));
  CHECK(assembled(team, 2).faces.size() == 2 * 40 * 40);
  CHECK(assembled(team, 5).vertices.size() == 61 * 61);
  CHECK(assembled(team, 5).faces.size() == 2 * 60 * 60);

  MeshChunk chunk = chunks_of(5, 1).front();
  const std::size_t faces = chunk.faces.size(), chunks = team.placed().size();
  chunk.faces.resize(1);
  CHECK(team.add(chunk) == ChunkVerdict::kTaken);
  CHECK(assembled(team, 5).faces.size() == 2 * 60 * 60 - faces + 1);
  // Chunk without faces
  CHECK(team.add(MeshChunk{.key = chunk.key, .boot = 1}) == ChunkVerdict::kTaken);
  CHECK(assembled(team, 5).faces.size() == 2 * 60 * 60 - faces);
  CHECK(team.placed().size() == chunks - 1);
}

TEST_CASE("A robot that restarts replaces its mesh") {
  TeamMesh team;
  add_all(team, chunks_of(5, 77));
  REQUIRE(team.add(MeshPoses{.robot = 5, .boot = 77}) == ChunkVerdict::kTaken);
  SECTION("poses come first") {
    CHECK(team.add(MeshPoses{.robot = 5, .boot = 78}) == ChunkVerdict::kTaken);
    CHECK(team.placed().empty());
    CHECK(team.add(MeshPoses{.robot = 5, .boot = 77}) == ChunkVerdict::kEarlierBoot);
  }
  const std::vector<MeshChunk> fresh = chunks_of(5, 78, 10);
  add_all(team, fresh);
  CHECK(assembled(team, 5).vertices.size() == 11 * 11);
  CHECK(team.add(chunks_of(5, 77).front()) == ChunkVerdict::kEarlierBoot);
  CHECK(assembled(team, 5).vertices.size() == 11 * 11);
}

TEST_CASE("A robot cannot send more than its bound") {
  MeshChunk chunk = chunks_of(5, 1, 10).front();
  TeamMesh team(10 * plain_bytes(chunk) + 1);
  for (std::int32_t i = 0; i < 10; ++i) {
    chunk.key.cell[0] = i;
    REQUIRE(team.add(chunk) == ChunkVerdict::kTaken);
  }
  chunk.key.cell[0] = -1;
  CHECK(team.add(chunk) == ChunkVerdict::kNoRoom);
  chunk.key.cell[0] = 0;
  CHECK(team.add(chunk) == ChunkVerdict::kTaken);  // replaces the former chunk
  CHECK(team.add(chunks_of(6, 1, 10).front()) == ChunkVerdict::kTaken);
}

}  // namespace
}  // namespace km
