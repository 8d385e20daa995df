#include <catch2/catch.hpp>

#include "modules/core/camera.hpp"

namespace km {
namespace {

PinholeCamera euroc_left() {
  return {.width = 752,
          .height = 480,
          .fx = 458.654,
          .fy = 457.296,
          .cx = 367.215,
          .cy = 248.375,
          .distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}};
}

TEST_CASE("Unprojecting inverts projecting over the whole image", "[core]") {
  const PinholeCamera camera = euroc_left();
  for (double u = 0; u <= 752; u += 47)
    for (double v = 0; v <= 480; v += 48) {
      const auto bearing = camera.unproject({u, v});
      REQUIRE(bearing.has_value());
      CHECK((camera.project(*bearing) - Eigen::Vector2d(u, v)).norm() < 1e-8);
    }
}

TEST_CASE("Without distortion a bearing is linear in the pixel", "[core]") {
  PinholeCamera camera = euroc_left();
  camera.distortion = {0, 0, 0, 0};
  const auto bearing = camera.unproject({camera.cx + 458.654, camera.cy});
  REQUIRE(bearing.has_value());
  CHECK((*bearing - Eigen::Vector2d(1, 0)).norm() < 1e-12);
}

TEST_CASE("A pixel that no bearing maps to has no bearing", "[core]") {
  CHECK_FALSE(euroc_left().unproject({1e6, 1e6}).has_value());
}

}  // namespace
}  // namespace km
