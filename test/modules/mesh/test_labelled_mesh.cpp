#include <catch2/catch.hpp>

#include <cmath>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {
namespace {

LabelledMesh triangle() {
  LabelledMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.labels = {3, 5, 5};
  mesh.faces = {{0, 1, 2}};
  return mesh;
}

TEST_CASE("A face has the label of most of its vertices") {
  LabelledMesh mesh = triangle();
  CHECK(mesh.face_label(0) == 5);
  mesh.labels = {3, 4, 5};
  CHECK(mesh.face_label(0) == 3);
  mesh.labels.clear();
  CHECK(mesh.face_label(0) == 0);
}

TEST_CASE("Appending keeps faces on their vertices and fills up what one mesh lacks") {
  LabelledMesh mesh = triangle();
  LabelledMesh other = triangle();
  other.labels.clear();
  other.colors.assign(3, {1, 2, 3});
  mesh.append(other);
  CHECK(mesh.faces[1] == LabelledMesh::Face{3, 4, 5});
  CHECK(mesh.labels == std::vector<LabelId>{3, 5, 5, 0, 0, 0});
  REQUIRE(mesh.colors.size() == 6);
  CHECK(mesh.colors[2] == LabelledMesh::Color{0, 0, 0});
  CHECK(mesh.colors[3] == LabelledMesh::Color{1, 2, 3});
}

TEST_CASE("A mesh is moved as the transform says") {
  LabelledMesh mesh = triangle();
  const Eigen::Matrix3d quarter_turn =
      Eigen::AngleAxisd(std::acos(-1.0) / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  mesh.transform(make_pose(quarter_turn, {1, 2, 3}));
  CHECK((mesh.vertices[1] - Eigen::Vector3f(1, 3, 3)).norm() < 1e-6);
}

TEST_CASE("Vertices take the colour of their class, black outside the palette") {
  LabelledMesh mesh = triangle();
  mesh.colour_by(LabelPalette({{5, "road", {10, 20, 30}}}));
  CHECK(mesh.colors[0] == LabelledMesh::Color{0, 0, 0});
  CHECK(mesh.colors[1] == LabelledMesh::Color{10, 20, 30});
}

}  // namespace
}  // namespace km
