#include <catch2/catch.hpp>

#include <cstring>
#include <map>

#include "modules/ros_dds/drawings.hpp"

namespace km {
namespace {

template <typename T>
T value_at(const RosPointCloud2& cloud, std::size_t point, std::size_t field) {
  T value{};
  std::memcpy(&value, &cloud.data[point * cloud.point_step + cloud.fields[field].offset],
              sizeof(value));
  return value;
}

TEST_CASE("A mesh is published as its vertices with their colours", "[ros_dds]") {
  LabelledMesh mesh;
  mesh.vertices = {{1, 2, 3}, {4, 5, 6.5F}};
  mesh.colors = {{0x12, 0x34, 0x56}, {1, 2, 3}};
  const RosPointCloud2 cloud = cloud_of(mesh, 10, {5, "map"});
  CHECK(cloud.header.frame_id == "map");
  CHECK(cloud.height == 1);
  CHECK(cloud.width == 2);
  CHECK(cloud.point_step == 16);
  CHECK(cloud.row_step == 32);
  REQUIRE(cloud.data.size() == 32);
  CHECK(cloud.fields[3].name == "rgb");
  CHECK(value_at<float>(cloud, 1, 2) == 6.5F);
  CHECK(value_at<std::uint32_t>(cloud, 0, 3) == 0x123456);
  mesh.colors.clear();
  CHECK(cloud_of(mesh, 10, {}).point_step == 12);
  CHECK(cloud_of(mesh, 10, {}).fields.size() == 3);
}

TEST_CASE("A large mesh is published as a bounded number of vertices from all its parts",
          "[ros_dds]") {
  LabelledMesh mesh;
  for (int k = 0; k < 1000; ++k) mesh.vertices.emplace_back(static_cast<float>(k), 0.0F, 0.0F);
  for (const std::size_t most : {1U, 7U, 300U, 999U, 1000U, 2000U}) {
    CAPTURE(most);
    const RosPointCloud2 cloud = cloud_of(mesh, most, {});
    CHECK(cloud.width <= most);
    CHECK(2 * cloud.width > std::min<std::size_t>(most, 1000));
    CHECK(value_at<float>(cloud, cloud.width - 1, 0) >=
          999.0F - 1000.0F / static_cast<float>(cloud.width));
  }
}

// A square of `n` by `n` cells, two faces each, of 5 cm.
LabelledMesh square(std::uint32_t n) {
  LabelledMesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x) {
      mesh.vertices.emplace_back(0.05F * static_cast<float>(x), 0.05F * static_cast<float>(y),
                                 1.0F);
      mesh.colors.push_back({static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 0});
    }
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t corner = y * (n + 1) + x;
      mesh.faces.push_back({corner, corner + 1, corner + n + 2});
      mesh.faces.push_back({corner, corner + n + 2, corner + n + 1});
    }
  return mesh;
}

double area_m2(const LabelledMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.faces)
    area += 0.5 * static_cast<double>((mesh.vertices[b] - mesh.vertices[a])
                                          .cross(mesh.vertices[c] - mesh.vertices[a])
                                          .norm());
  return area;
}

// Points of each piece, as a viewer shows them that has received all markers.
void show(SurfacePieces& pieces, std::map<std::int32_t, std::size_t>& shown) {
  while (const auto marker = pieces.next({7, "map"})) {
    CHECK(marker->header.frame_id == "map");
    CHECK(encode_ros(*marker).size() < 65536);
    CHECK(marker->colors.size() == marker->points.size());
    if (marker->action == RosMarkerAction::kDelete)
      CHECK(shown.erase(marker->id) == 1);
    else
      shown[marker->id] = marker->points.size();
  }
}

std::size_t faces_of(const std::map<std::int32_t, std::size_t>& shown) {
  std::size_t points = 0;
  for (const auto& [id, count] : shown) points += count;
  return points / 3;
}

TEST_CASE(
    "All faces of a mesh are published in small pieces and pieces of the former mesh are deleted",
    "[ros_dds]") {
  SurfacePieces pieces;
  CHECK_FALSE(pieces.next({}));
  std::map<std::int32_t, std::size_t> shown;
  for (const std::uint32_t n : {40U, 70U, 10U, 0U, 20U}) {
    CAPTURE(n);
    pieces.offer(std::make_shared<const LabelledMesh>(square(n)));
    show(pieces, shown);
    CHECK(faces_of(shown) == 2 * n * n);
    CHECK(shown.size() == SurfacePieces::count(2 * n * n));
  }
}

TEST_CASE("A new mesh waits until the present one is published", "[ros_dds]") {
  SurfacePieces pieces;
  pieces.offer(std::make_shared<const LabelledMesh>(square(40)));  // 7 pieces
  REQUIRE(pieces.next({}));
  pieces.offer(std::make_shared<const LabelledMesh>(square(10)));
  pieces.offer(std::make_shared<const LabelledMesh>(square(20)));
  for (int k = 1; k < 7; ++k) CHECK(pieces.next({})->id == k);
  CHECK(pieces.next({})->points.size() == 3 * 500);  // pieces of the newest mesh
  CHECK(pieces.next({})->points.size() == 3 * 300);
}

TEST_CASE("A mesh with too many faces is coarsened and covers the same area", "[ros_dds]") {
  const LabelledMesh mesh = square(100);
  CHECK(coarsened(mesh, 20000).faces == mesh.faces);
  for (const std::size_t most : {10000U, 1000U, 100U}) {
    const LabelledMesh coarse = coarsened(mesh, most);
    CAPTURE(most, coarse.faces.size());
    CHECK(coarse.faces.size() <= most);
    CHECK(coarse.faces.size() > most / 5);
    CHECK(area_m2(coarse) == Approx(area_m2(mesh)).epsilon(0.3));
    CHECK(coarse.colors.size() == coarse.vertices.size());
  }
}

}  // namespace
}  // namespace km
