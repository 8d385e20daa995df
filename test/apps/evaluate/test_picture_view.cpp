#include <catch2/catch.hpp>

#include "apps/evaluate/picture_view.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"

namespace km {
namespace {

const Eigen::AlignedBox3d kBox(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(10, 5, 2));

}  // namespace

TEST_CASE("From above y is up and from the front z, and x is to the right", "[mesh_picture]") {
  const PictureView view = parse_view("top", kBox, 520, 400);
  CHECK(view.scale == Approx(50.0));  // 10 m and 4 % in 520 px
  CHECK(view.project({5, 2.5, 0}).head<2>().isApprox(Eigen::Vector2d(260, 200)));
  CHECK(view.project({6, 2.5, 0}).head<2>().isApprox(Eigen::Vector2d(310, 200)));
  CHECK(view.project({5, 3.5, 0}).head<2>().isApprox(Eigen::Vector2d(260, 150)));
  CHECK(view.project({5, 2.5, 0}).z() - view.project({5, 2.5, 1.5}).z() == Approx(1.5));
  const PictureView front = parse_view("front", kBox, 520, 400);
  CHECK(front.project({6, 0, 1}).isApprox(Eigen::Vector3d(310, 200, front.project({5, 0, 2}).z())));
  CHECK(front.project({5, 0, 2}).y() == Approx(150));
  CHECK(front.project({5, 4, 1}).z() - front.project({5, 1, 1}).z() == Approx(3.0));
}

TEST_CASE("A view from a position has the direction of yaw and pitch", "[mesh_picture]") {
  const PictureView view = parse_view("1,2,3,90,0", kBox, 200, 100);
  CHECK(view.project({1, 7, 3}).isApprox(Eigen::Vector3d(100, 50, 5)));
  CHECK(view.project({2, 7, 3}).x() > 100.0);  // looking along y, x is to the right
  CHECK(view.project({1, 7, 4}).y() < 50.0);
  const PictureView down = parse_view("1,2,3,0,-90", kBox, 200, 100);
  CHECK(down.project({1, 2, 0}).isApprox(Eigen::Vector3d(100, 50, 3)));
  CHECK(down.project({2, 2, 0}).y() < 50.0);  // ahead is up
  CHECK(down.project({1, 3, 0}).x() < 100.0);
}

TEST_CASE("Other views are refused with their text", "[mesh_picture]") {
  for (const char* text :
       {"", "up", "1,2,3", "1,2,3,4,x", "1,2,3,4,5,6", "1,,3,4,5", "nan,0,0,0,0"}) {
    CAPTURE(text);
    CHECK_THROWS_WITH(parse_view(text, kBox, 100, 100),
                      Catch::StartsWith("no view '" + std::string(text) + "'"));
  }
}

TEST_CASE("A few stray vertices do not affect the extent", "[mesh_picture]") {
  LabelledMesh mesh = square(10.0F, 0.0F, 99);  // 10,000 vertices
  mesh.vertices.emplace_back(500.0F, -300.0F, 80.0F);
  const Eigen::AlignedBox3d box = extent_of(mesh);
  CHECK(box.max().x() == Approx(10.0).margin(0.11));
  CHECK(box.min().y() == Approx(0.0).margin(0.11));
  CHECK(box.max().z() == 0.0);
  CHECK(extent_of(room()).isApprox(
      Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4, 3, 2))));
  CHECK(extent_of({}).isEmpty());
}

}  // namespace km
