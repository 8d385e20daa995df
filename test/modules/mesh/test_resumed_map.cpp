#include "modules/core/io/input_file.hpp"
#include "modules/mesh/map_file.hpp"
#include "modules/mesh/resumed_map.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// A strip of `faces` triangles along x from `x_m` on, seen by keyframes 2 and 9.
MapMesh strip(std::uint32_t faces, float x_m, std::uint64_t first_id) {
  MapMesh map;
  for (std::uint32_t v = 0; v < faces + 2; ++v) {
    map.mesh.vertices.emplace_back(x_m + static_cast<float>(v), static_cast<float>(v % 2), 0.0F);
    map.mesh.labels.push_back(static_cast<LabelId>(v % 3));
    map.mesh.colors.push_back({static_cast<std::uint8_t>(v), 1, 2});
    map.seen_by.push_back({2, 9});
    map.ids.push_back(first_id + 3 * v);
    map.certainty.push_back(static_cast<std::uint8_t>(v));
  }
  for (std::uint32_t f = 0; f < faces; ++f) map.mesh.faces.push_back({f, f + 1, f + 2});
  map.voxel_m = 0.05;
  return map;
}

void check_equal(const MapMesh& a, const MapMesh& b) {
  CHECK(a.mesh.vertices == b.mesh.vertices);
  CHECK(a.mesh.labels == b.mesh.labels);
  CHECK(a.mesh.colors == b.mesh.colors);
  CHECK(a.mesh.faces == b.mesh.faces);
  CHECK(a.seen_by == b.seen_by);
  CHECK(a.ids == b.ids);
  CHECK(a.certainty == b.certainty);
  CHECK(a.voxel_m == b.voxel_m);
}

TEST_CASE("A map is read from its file to the last bit") {
  const TemporaryFolder folder;
  const auto file = folder.path() / "run.map";
  for (MapMesh map : {strip(7, 0.0F, 5), MapMesh()}) {
    write_map_file(file, map);
    check_equal(read_map_file(file), map);
    map.mesh.labels.clear();
    map.certainty.clear();
    write_map_file(file, map);
    check_equal(read_map_file(file), map);
  }
}

TEST_CASE("A map file that is truncated or corrupted is refused by name") {
  const TemporaryFolder folder;
  write_map_file(folder.path() / "run.map", strip(3, 0.0F, 0));
  const std::string bytes = folder.read("run.map");
  const auto refused = [&](const std::string& text) {
    CHECK_THROWS_WITH(read_map_file(folder.write("corrupted.map", text)),
                      Contains("corrupted.map"));
  };
  for (std::size_t size = 0; size < bytes.size(); ++size) refused(bytes.substr(0, size));
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string corrupted = bytes;
    corrupted[at] = static_cast<char>(corrupted[at] ^ 4);
    refused(corrupted);
  }
  refused(bytes + "x");
  CHECK_THROWS_AS(read_map_file(folder.path() / "missing"), InputFileError);
}

TEST_CASE("A map file with faces of missing vertices is refused") {
  const TemporaryFolder folder;
  MapMesh map = strip(3, 0.0F, 0);
  map.mesh.faces[1][2] = 5;
  write_map_file(folder.path() / "run.map", map);
  CHECK_THROWS_WITH(read_map_file(folder.path() / "run.map"), Contains("is not whole"));
  map = strip(3, 0.0F, 0);
  map.ids[2] = map.ids[1];
  write_map_file(folder.path() / "run.map", map);
  CHECK_THROWS_AS(read_map_file(folder.path() / "run.map"), InputFileError);
}

TEST_CASE("New surface is appended to the former map under ids that follow") {
  const ResumedMap resumed(strip(4, 0.0F, 100), 6);
  const MapMesh now = strip(2, 50.0F, 0);
  const MapMesh both = resumed.with(now);
  REQUIRE(both.mesh.vertices.size() == 10);
  CHECK(both.mesh.vertices[6].x() == 50.0F);
  CHECK(both.mesh.faces.back() == LabelledMesh::Face{7, 8, 9});
  CHECK(both.seen_by[0] == std::array<KeyframeIndex, 2>{2, 5});  // keyframe 9 was not stored then
  CHECK(both.seen_by[6] == std::array<KeyframeIndex, 2>{2, 9});
  CHECK(both.ids[5] == 115);
  CHECK(both.ids[6] == 116);
  CHECK(both.ids[9] == 125);
  CHECK(both.certainty[9] == 3);
  check_equal(resumed.with(MapMesh()), resumed.before());
}

TEST_CASE("Superseded surface of the former map is dropped and the mapper gets its own part") {
  ResumedMap resumed(strip(4, 0.0F, 100), 20);  // ids 100, 103, ... 115; then from 116 on
  const SupersededSurface rest =
      resumed.drop({{{100, 119}, {103, 119}, {106, 119}, {119, 122}, {122, 115}, {125, 119}}});
  REQUIRE(rest.vertices.size() == 2);  // a vertex with a replacement in the former map stays
  CHECK(rest.vertices[0].id == 3);
  CHECK(rest.vertices[0].replacement == 6);
  CHECK(rest.vertices[1].id == 9);
  const MapMesh& left = resumed.before();
  CHECK(left.mesh.faces == std::vector<LabelledMesh::Face>{{0, 1, 2}, {1, 2, 3}, {2, 3, 4}});
  CHECK(left.ids == std::vector<std::uint64_t>{103, 106, 109, 112, 115});
  CHECK(left.mesh.vertices[0].x() == 1.0F);
  CHECK(left.seen_by.size() == 5);
  CHECK(resumed.with(strip(1, 9.0F, 0)).ids[5] == 116);  // as before
}

}  // namespace
}  // namespace km
