#include <catch2/catch.hpp>

#include <cstring>

#include "modules/ros_dds/mesh_cloud.hpp"

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

}  // namespace
}  // namespace km
