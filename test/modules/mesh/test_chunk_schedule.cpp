#include <catch2/catch.hpp>
#include <vector>

#include "modules/mesh/chunk_schedule.hpp"

namespace km {
namespace {

MeshChunk chunk(std::int32_t cell, std::uint16_t height = 0) {
  return {.key = {.robot = 1, .cell = {cell, 0, 0}},
          .offsets = {{0, 0, height}, {1, 0, 0}, {0, 1, 0}},
          .labels = {},
          .faces = {{0, 1, 2}}};
}

// Cells in the order in which they are sent, until nothing is left.
std::vector<std::int32_t> sent_cells(ChunkSchedule& schedule) {
  std::vector<std::int32_t> cells;
  while (const auto next = schedule.next()) cells.push_back(next->key.cell[0]);
  return cells;
}

using Cells = std::vector<std::int32_t>;

TEST_CASE("Only what changed is sent again", "[mesh]") {
  ChunkSchedule schedule(0.0);
  schedule.update({chunk(0), chunk(1), chunk(2)});
  CHECK(schedule.waiting() == 3);
  CHECK(sent_cells(schedule) == Cells{0, 1, 2});
  schedule.update({chunk(0), chunk(1, 7), chunk(2), chunk(3)});
  CHECK(sent_cells(schedule) == Cells{3, 1});
  schedule.update({chunk(0), chunk(1, 7), chunk(2), chunk(3)});
  CHECK(sent_cells(schedule).empty());
}

TEST_CASE("Moves below the threshold are sent when they have added up", "[mesh]") {
  ChunkSchedule schedule(0.010);  // chunks have steps of 1 mm
  schedule.update({chunk(0)});
  CHECK(sent_cells(schedule) == Cells{0});
  schedule.update({chunk(0, 6)});
  CHECK(sent_cells(schedule).empty());
  schedule.update({chunk(0, 12)});
  CHECK(sent_cells(schedule) == Cells{0});
}

TEST_CASE("The newest state of a chunk is sent, once", "[mesh]") {
  ChunkSchedule schedule(0.0);
  schedule.update({chunk(0, 1)});
  schedule.update({chunk(0, 2)});
  schedule.update({chunk(0, 3)});
  const auto sent = schedule.next();
  REQUIRE(sent);
  CHECK(sent->offsets[0][2] == 3);
  CHECK_FALSE(schedule.next());
  schedule.update({chunk(0, 4)});
  schedule.update({chunk(0, 3)});  // and back before its turn
  CHECK_FALSE(schedule.next());
}

TEST_CASE("A cell that vanished is sent empty, once, and may return", "[mesh]") {
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

TEST_CASE("A cell that vanishes before it was sent is never sent", "[mesh]") {
  ChunkSchedule schedule(0.0);
  schedule.update({chunk(0), chunk(1)});
  schedule.update({chunk(1)});
  CHECK(sent_cells(schedule) == Cells{1});
}

TEST_CASE("Every chunk has its turn although all change faster than they can be sent", "[mesh]") {
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

}  // namespace
}  // namespace km
