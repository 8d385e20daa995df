#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "modules/core/camera.hpp"

namespace km {
namespace {

TEST_CASE("Pixels to bearings and back", "[!benchmark]") {
  Camera camera{
      .width = 752, .height = 480, .fx = 458.654, .fy = 457.296, .cx = 367.215, .cy = 248.375};
  for (const Lens& lens :
       {Lens(LensModel::kRadialTangential, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}),
        Lens(LensModel::kRadialTangential, {0.45, 0.12, -3e-4, 2e-4, 0.011, 0.82, 0.31, 0.04}),
        Lens(LensModel::kEquidistant, {0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673}),
        Lens(LensModel::kOmnidirectional, {0.80065662, -0.3351875, 0.13211436, 5.6e-4, 5.8e-4}),
        Lens(LensModel::kDoubleSphere, {-0.17213086, 0.59311776})}) {
    camera.lens = lens;
    std::vector<Eigen::Vector2d> pixels, bearings;
    for (int y = 0; y < camera.height; y += 8)
      for (int x = 0; x < camera.width; x += 8)
        if (const auto bearing = camera.unproject(Eigen::Vector2d(x, y))) {
          pixels.emplace_back(x, y);
          bearings.push_back(*bearing);
        }
    const std::string name = to_string(lens.model()) + ' ' +
                             std::to_string(lens.coefficients().size()) +
                             ", n=" + std::to_string(pixels.size());
    BENCHMARK("project " + name) {
      double sum = 0.0;
      for (const Eigen::Vector2d& bearing : bearings) sum += camera.project(bearing)->x();
      return sum;
    };
    BENCHMARK("unproject " + name) {
      double sum = 0.0;
      for (const Eigen::Vector2d& pixel : pixels) sum += camera.unproject(pixel)->x();
      return sum;
    };
  }
}

}  // namespace
}  // namespace km
