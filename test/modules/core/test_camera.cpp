#include <catch2/catch.hpp>
#include <cmath>

#include "modules/core/camera.hpp"

namespace km {
namespace {

Camera euroc_left() {
  return {.width = 752,
          .height = 480,
          .fx = 458.654,
          .fy = 457.296,
          .cx = 367.215,
          .cy = 248.375,
          .lens = Lens(LensModel::kRadialTangential,
                       {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05})};
}

TEST_CASE("Unprojecting inverts projecting over the whole image", "[core]") {
  const Camera camera = euroc_left();
  for (double u = 0; u <= 752; u += 47)
    for (double v = 0; v <= 480; v += 48) {
      const auto bearing = camera.unproject({u, v});
      REQUIRE(bearing.has_value());
      CHECK((camera.project(*bearing).value() - Eigen::Vector2d(u, v)).norm() < 1e-8);
    }
}

TEST_CASE("A pixel without a bearing has none", "[core]") {
  CHECK_FALSE(euroc_left().unproject({1e6, 1e6}).has_value());
  CHECK_FALSE(euroc_left().unproject({std::nan(""), 100.0}).has_value());
}

TEST_CASE("A ray that does not point forward has no pixel", "[core]") {
  const Camera camera = euroc_left();
  CHECK(camera.project_ray({0.2, -0.1, 2.0}) == camera.project({0.1, -0.05}));
  CHECK_FALSE(camera.project_ray({0.1, -0.05, 0.0}).has_value());
  CHECK_FALSE(camera.project_ray({0.1, -0.05, -1.0}).has_value());
}

}  // namespace
}  // namespace km
