#include <catch2/catch.hpp>

#include "modules/core/lie.hpp"
#include "modules/evaluation/mesh/surface_copies.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"

namespace km {

TEST_CASE("The distance of two copies of a room is the shift of its walls", "[surface_copies]") {
  LabelledMesh moved = room();
  moved.transform(make_pose(Eigen::Matrix3d::Identity(), {0.03, 0.03, 0.03}));
  const auto copies = compare_copies(room(), moved);
  REQUIRE(copies);
  CHECK(copies->shared > 0.9);
  CHECK(copies->median_m == Approx(0.03).margin(1e-4));
  CHECK(copies->median_aligned_m < 1e-4);
}

TEST_CASE("The two sides of a wall are not copies", "[surface_copies]") {
  LabelledMesh other_side = room();
  for (auto& face : other_side.faces) std::swap(face[1], face[2]);
  const auto copies = compare_copies(room(), other_side);
  REQUIRE(copies);
  CHECK(copies->points == 0);
}

}  // namespace km
