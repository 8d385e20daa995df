#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "modules/evaluation/picture/surface_image.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"

namespace km {
namespace {

// 10 px per metre; the middle of the picture is the origin, its right x, its top y.
PictureView from_above() {
  PictureView view;
  view.width = 100;
  view.height = 80;
  view.scale = 10.0;
  view.T_cam_world = make_pose(Eigen::Vector3d(1, -1, -1).asDiagonal(), {0, 0, 100});
  return view;
}

LabelledMesh triangle(float z) {
  LabelledMesh mesh;
  mesh.vertices = {{1, 1, z}, {4, 1, z}, {1, 3, z}};  // columns 60 to 90, rows 30 to 10
  mesh.faces = {{0, 1, 2}};
  return mesh;
}

std::size_t covered(const SurfaceImage& image) {
  std::size_t count = 0;
  for (const std::uint32_t face : image.faces) count += face != SurfaceImage::kNone ? 1 : 0;
  return count;
}

}  // namespace

TEST_CASE("A triangle covers the pixels whose centres it holds", "[mesh_picture]") {
  const SurfaceImage image = rasterise(triangle(2.0F), from_above());
  CHECK(image.faces[image.at(60, 29)] == 0);  // its right angle
  CHECK(image.faces[image.at(59, 29)] == SurfaceImage::kNone);
  CHECK(image.faces[image.at(60, 30)] == SurfaceImage::kNone);
  CHECK(image.faces[image.at(88, 29)] == 0);
  CHECK(image.faces[image.at(89, 28)] == SurfaceImage::kNone);
  CHECK(image.faces[image.at(60, 11)] == 0);
  CHECK(image.depth_m[image.at(60, 29)] == Approx(98.0F));
  CHECK(std::isinf(image.depth_m[image.at(0, 0)]));
  CHECK(std::abs(static_cast<double>(covered(image)) - 300.0) <= 20.0);  // half of 30 x 20
}

TEST_CASE("The nearer face is in front, whatever the order", "[mesh_picture]") {
  const bool high_first = GENERATE(true, false);
  LabelledMesh mesh = triangle(high_first ? 5.0F : 2.0F);
  mesh.append(triangle(high_first ? 2.0F : 5.0F));
  const SurfaceImage image = rasterise(mesh, from_above());
  CHECK(image.faces[image.at(65, 25)] == (high_first ? 0U : 1U));
  CHECK(image.depth_m[image.at(65, 25)] == Approx(95.0F));
}

TEST_CASE("Faces that cross are each in front where they are nearer", "[mesh_picture]") {
  LabelledMesh mesh = rectangle({-2, -2, -1}, {4, 0, 2}, {0, 4, 0}, 1);  // rises with x
  mesh.append(rectangle({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 1));
  const SurfaceImage image = rasterise(mesh, from_above());
  CHECK(image.faces[image.at(40, 40)] >= 2);
  CHECK(image.faces[image.at(60, 40)] < 2);
}

TEST_CASE("Back faces and what is above the cut are not drawn", "[mesh_picture]") {
  LabelledMesh ceiling = triangle(5.0F);
  std::swap(ceiling.faces[0][1], ceiling.faces[0][2]);  // made to be seen from below
  LabelledMesh mesh = triangle(2.0F);
  mesh.append(ceiling);
  const auto drawn = [&](const SurfaceCut& cut) {
    const SurfaceImage image = rasterise(mesh, from_above(), cut);
    return image.faces[image.at(65, 25)];
  };
  CHECK(drawn({}) == 1);
  CHECK(drawn({true, 10.0}) == 0);
  CHECK(drawn({false, 4.0}) == 0);
  CHECK(drawn({false, 1.0}) == SurfaceImage::kNone);
  // A slope is cut where it crosses the height.
  const LabelledMesh slope = rectangle({-2, -2, -2}, {4, 0, 4}, {0, 4, 0}, 1);
  const SurfaceImage image = rasterise(slope, from_above(), {false, 0.0});
  CHECK(image.faces[image.at(48, 40)] != SurfaceImage::kNone);
  CHECK(image.faces[image.at(52, 40)] == SurfaceImage::kNone);
}

TEST_CASE("Perspective shows depth along z and cuts what is behind", "[mesh_picture]") {
  PictureView view;
  view.width = view.height = 100;
  view.perspective = true;
  view.scale = 50.0;
  // A floor one metre below the viewer, from 10 m behind to 90 m ahead.
  const LabelledMesh floor = rectangle({-50, 1, -10}, {100, 0, 0}, {0, 0, 100}, 1);
  const SurfaceImage image = rasterise(floor, view);
  for (const int row : {55, 60, 75, 99}) {
    CAPTURE(row);
    const double expected_m = 50.0 / (row + 0.5 - 50.0);
    CHECK(image.depth_m[image.at(50, row)] == Approx(expected_m).epsilon(1e-4));
  }
  CHECK(image.faces[image.at(50, 45)] == SurfaceImage::kNone);
  CHECK(image.faces[image.at(50, 50)] == SurfaceImage::kNone);  // beyond 90 m
}

TEST_CASE("Neighbouring faces leave no gap between them", "[mesh_picture]") {
  const LabelledMesh mesh = rectangle({-3.07F, -2.91F, 0}, {6.1F, 0, 0}, {0, 5.9F, 0}, 37);
  const SurfaceImage image = rasterise(mesh, from_above());
  for (int row = 12; row < 68; ++row)
    for (int column = 21; column < 79; ++column)
      REQUIRE(image.faces[image.at(column, row)] != SurfaceImage::kNone);
}

}  // namespace km
