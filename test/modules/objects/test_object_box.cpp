#include <catch2/catch.hpp>
#include <random>

#include "modules/objects/object_box.hpp"

namespace km {
namespace {

TEST_CASE("The enclosing box of the corners of a box is that box", "[objects]") {
  const double yaw = GENERATE(-1.5, -0.3, 0.0, 0.7, 1.5);
  const ObjectBox box{{3.0, -4.0, 0.5}, yaw, {2.0, 0.7, 1.2}};
  const auto corners = corners_of(box);
  const ObjectBox found = enclosing_box(corners);
  CHECK((found.center - box.center).norm() < 1e-9);
  CHECK((found.size_m - box.size_m).norm() < 1e-9);
  CHECK(found.yaw_rad == Approx(yaw).margin(1e-9));
}

TEST_CASE("Shared volumes agree with counted points", "[objects]") {
  const auto seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto any = [&] {
    const double x = unit(random), y = unit(random), z = unit(random), yaw = 1.5 * unit(random);
    const double a = unit(random), b = unit(random), c = unit(random);
    return ObjectBox{{x, y, z}, yaw, {2.0 + a, 1.5 + b, 2.0 + c}};
  };
  const ObjectBox a = any(), b = any();
  const SE3 T_b_a = b.pose().inverse() * a.pose();
  int inside = 0;
  constexpr int kPoints = 20000;
  for (int i = 0; i < kPoints; ++i) {
    const double x = unit(random), y = unit(random), z = unit(random);
    const Eigen::Vector3d p_a = 0.5 * a.size_m.cwiseProduct(Eigen::Vector3d(x, y, z));
    inside += ((T_b_a * p_a).cwiseAbs().array() <= 0.5 * b.size_m.array()).all() ? 1 : 0;
  }
  const double share = static_cast<double>(inside) / kPoints;
  CHECK(shared_volume_m3(a, b) / a.volume_m3() == Approx(share).margin(0.02));
  CHECK(shared_volume_m3(b, a) == Approx(shared_volume_m3(a, b)).margin(1e-9));
}

}  // namespace
}  // namespace km
