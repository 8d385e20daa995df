#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>
#include <string>

#include "modules/simulation/dataset/world_ply.hpp"

namespace km {
namespace {

template <typename T>
T value_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  T value;
  REQUIRE(at + sizeof(T) <= bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

// Two triangles on three vertices, of two classes.
World two_triangles() {
  World world;
  world.mesh.vertices = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  world.mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
  world.mesh.materials = {1, 0};
  world.materials.resize(2);
  world.materials[0].label = SurfaceClass::kRoad;
  world.materials[1].label = SurfaceClass::kBuilding;
  return world;
}

}  // namespace

TEST_CASE("The world's mesh is written with classes and their colours", "[simulation][dataset]") {
  const World world = two_triangles();
  const LabelPalette& palette = simulation_palette();
  const auto bytes = world_ply(world, palette);
  const std::string text(bytes.begin(), bytes.end());
  const std::string end = "end_header\n";
  const std::size_t body = text.find(end) + end.size();
  CHECK_THAT(text.substr(0, body), Catch::StartsWith("ply\nformat binary_little_endian 1.0\n") &&
                                       Catch::Contains("element vertex 3\n") &&
                                       Catch::Contains("element face 2\n") &&
                                       Catch::Contains("property uchar label\n"));
  REQUIRE(bytes.size() == body + 3 * 12 + 2 * 17);
  CHECK(value_at<float>(bytes, body + 12) == 4.0F);
  CHECK(value_at<float>(bytes, body + 32) == 9.0F);

  const std::size_t face = body + 36;
  CHECK(value_at<std::uint8_t>(bytes, face) == 3);
  CHECK(value_at<std::int32_t>(bytes, face + 9) == 2);
  const auto building = static_cast<LabelId>(SurfaceClass::kBuilding);
  CHECK(value_at<std::uint8_t>(bytes, face + 13) == building);
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(value_at<std::uint8_t>(bytes, face + 14 + i) == palette.find(building)->color[i]);
  CHECK(value_at<std::uint8_t>(bytes, face + 17 + 13) == static_cast<LabelId>(SurfaceClass::kRoad));
}

}  // namespace km
