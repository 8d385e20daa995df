#include <Eigen/LU>
#include <opencv2/calib3d.hpp>
#include <opencv2/ccalib/omnidir.hpp>

#include "modules/core/camera/lens.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Published calibrations: cam0 of EuRoC, and of TUM-VI at 512 x 512 with Kannala-Brandt and
// double-sphere lens.
const Lens kEuroc(LensModel::kRadialTangential,
                  {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
const Lens kTumVi(LensModel::kEquidistant, {0.0034823894022493434, 0.0007150348452162257,
                                            -0.0020532361418706202, 0.00020293673591811182});
const Lens kTumViDoubleSphere(LensModel::kDoubleSphere, {-0.17213086034353243, 0.5931177593944744});
// From Kalibr's documentation.
const Lens kOmni(LensModel::kOmnidirectional,
                 {0.80065662, -0.33518750, 0.13211436, 0.00055967, 0.00057686});
const Lens kRational(LensModel::kRadialTangential,
                     {0.45, 0.12, -3e-4, 2e-4, 0.011, 0.82, 0.31, 0.04});

std::vector<Lens> all_lenses() {
  return {Lens(),
          kEuroc,
          Lens(LensModel::kRadialTangential, {-0.3, 0.1, 1e-3, -5e-4, -0.012}),
          kRational,
          kTumVi,
          Lens(LensModel::kEquidistant, {-0.05, 0.02, -0.03, 0.004}),
          kOmni,
          Lens(LensModel::kOmnidirectional, {2.2, -0.1, 0.4, 1e-3, -2e-3}),
          kTumViDoubleSphere,
          Lens(LensModel::kDoubleSphere, {0.3, 0.4}),
          Lens(LensModel::kDoubleSphere, {0.0, 0.6, 1.1})};
}

// Bearings over the whole disc of a lens, denser near the axis.
std::vector<Eigen::Vector2d> bearings_of(const Lens& lens) {
  std::vector<Eigen::Vector2d> bearings = {{0.0, 0.0}, {1e-12, -1e-12}, {1e-5, 2e-5}};
  constexpr int kRings = 60, kSpokes = 24;
  for (int ring = 1; ring <= kRings; ++ring)
    for (int spoke = 0; spoke < kSpokes; ++spoke) {
      const double share = static_cast<double>(ring) / kRings;
      const double r = (1.0 - 1e-9) * share * share * lens.max_bearing();
      const double angle = 2.0 * M_PI * spoke / kSpokes;
      bearings.emplace_back(r * std::cos(angle), r * std::sin(angle));
    }
  return bearings;
}

std::vector<double> vector_of(std::span<const double> values) {
  return {values.begin(), values.end()};
}

// The image points from OpenCV, for a focal length of 1.
std::vector<cv::Point2d> points_of_opencv(const Lens& lens,
                                          const std::vector<Eigen::Vector2d>& bearings) {
  std::vector<cv::Point3d> world;
  for (const Eigen::Vector2d& b : bearings) world.emplace_back(3.0 * b.x(), 3.0 * b.y(), 3.0);
  const cv::Matx31d none(0, 0, 0);
  const cv::Matx33d K = cv::Matx33d::eye();
  std::vector<double> k = vector_of(lens.coefficients());
  std::vector<cv::Point2d> points;
  if (lens.model() == LensModel::kEquidistant) {
    cv::fisheye::projectPoints(world, points, none, none, K, k);
  } else if (lens.model() == LensModel::kOmnidirectional) {
    const double xi = k.front();
    k.erase(k.begin());
    cv::omnidir::projectPoints(world, points, none, none, K, xi, k);
    for (cv::Point2d& point : points) point *= 1.0 + xi;
  } else {
    cv::projectPoints(world, none, none, K, k, points);
  }
  return points;
}

TEST_CASE("Lenses map bearings like OpenCV") {
  const auto index = GENERATE(range(0, 8));
  CAPTURE(index);
  const Lens lens = all_lenses()[static_cast<std::size_t>(index)];
  const auto bearings = bearings_of(lens);
  const auto expected = points_of_opencv(lens, bearings);
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    CAPTURE(bearings[i].transpose());
    const auto point = lens.distorted(bearings[i]);
    REQUIRE(point.has_value());
    CHECK((*point - Eigen::Vector2d(expected[i].x, expected[i].y)).norm() < 1e-9);
  }
}

TEST_CASE("A double sphere maps bearings like the equations of its paper") {
  // Computed by hand at (0.6, -0.8, 1) with xi = -0.2, alpha = 0.6: d1 = sqrt(2), xi d1 + z = 1 -
  // 0.2 sqrt(2), d2 = sqrt(1 + that^2).
  const Lens lens(LensModel::kDoubleSphere, {-0.2, 0.6});
  const double z = 1.0 - 0.2 * std::sqrt(2.0);
  const double below = 0.6 * std::sqrt(1.0 + z * z) + 0.4 * z;
  const Eigen::Vector2d expected = 0.8 * Eigen::Vector2d(0.6, -0.8) / below;
  CHECK((lens.distorted({0.6, -0.8}).value() - expected).norm() < 1e-14);

  // The enhanced unified model at the same bearing: d = sqrt(beta (x^2 + y^2) + z^2).
  const double unified = 0.6 * std::sqrt(1.1 + 1.0) + 0.4;
  const auto found = Lens(LensModel::kDoubleSphere, {0.0, 0.6, 1.1}).distorted({0.6, -0.8});
  CHECK((found.value() - Eigen::Vector2d(0.6, -0.8) / unified).norm() < 1e-14);

  // The lens of TUM-VI in two calibrations with separate focal lengths. They were estimated
  // independently, and agree to a pixel.
  const double f = 190.97847715128717, f_sphere = 158.28600034966977 / (1.0 - 0.17213086034353243);
  for (const double degrees : {5.0, 20.0, 40.0, 60.0, 75.0}) {
    const Eigen::Vector2d bearing(std::tan(degrees * M_PI / 180.0), 0.0);
    CAPTURE(degrees);
    const double equidistant_px = f * kTumVi.distorted(bearing).value().x();
    const double sphere_px = f_sphere * kTumViDoubleSphere.distorted(bearing).value().x();
    CHECK(sphere_px == Approx(equidistant_px).margin(1.0));
  }
}

TEST_CASE("Undistorting inverts distorting on the whole disc of a lens") {
  const auto index = GENERATE(range(0, 11));
  CAPTURE(index);
  const Lens lens = all_lenses()[static_cast<std::size_t>(index)];
  CHECK(lens.max_bearing() > 1.0);
  for (const Eigen::Vector2d& bearing : bearings_of(lens)) {
    CAPTURE(bearing.transpose(), lens.max_bearing());
    const auto back = lens.undistorted(lens.distorted(bearing).value());
    REQUIRE(back.has_value());
    // 1e-12 in the image; at the rim the change of a bearing is much larger than that of its image.
    CHECK((*back - bearing).norm() < 1e-9 * (1.0 + bearing.squaredNorm()));
  }
}

TEST_CASE("Random lenses are one-to-one on their discs") {
  const auto seed = GENERATE(1U, 2U, 3U, 4U, 5U, 6U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 60; ++i) {
    std::vector<double> k;
    const auto model = static_cast<LensModel>(i % 4);
    const std::size_t count[] = {i % 8 == 0 ? 8U : 5U, 4U, 5U, 2U};
    for (std::size_t c = 0; c < count[i % 4]; ++c) k.push_back(0.3 * unit(rng));
    if (model == LensModel::kRadialTangential) k[2] *= 0.03, k[3] *= 0.03;
    if (model == LensModel::kOmnidirectional) k[0] = 1.0 + unit(rng), k[3] *= 0.03, k[4] *= 0.03;
    if (model == LensModel::kDoubleSphere) k[0] *= 3.0, k[1] = 0.5 + 0.5 * unit(rng);
    const Lens lens(model, k);
    CAPTURE(i, k, lens.max_bearing());
    REQUIRE(lens.max_bearing() > 0.1);
    for (const Eigen::Vector2d& bearing : bearings_of(lens)) {
      if (bearing.norm() > 0.98 * lens.max_bearing()) continue;  // no slope at a fold
      CAPTURE(bearing.transpose());
      const auto back = lens.undistorted(lens.distorted(bearing).value());
      REQUIRE(back.has_value());
      REQUIRE((*back - bearing).norm() < 1e-6);
    }
    for (int k_point = 0; k_point < 50; ++k_point) {
      const double x = 3.0 * unit(rng), y = 3.0 * unit(rng);
      const auto bearing = lens.undistorted({x, y});
      if (bearing)
        REQUIRE((lens.distorted(*bearing).value() - Eigen::Vector2d(x, y)).norm() < 1e-9);
    }
  }
}

TEST_CASE("A lens ends where its distortion folds back") {
  // r - 0.3 r^3 and theta - 0.1 theta^3 have their maxima where their derivatives are 0.
  const Lens pinhole(LensModel::kRadialTangential, {-0.3, 0.0, 0.0, 0.0});
  CHECK(pinhole.max_bearing() == Approx(1.0 / std::sqrt(0.9)));
  const Lens fisheye(LensModel::kEquidistant, {-0.25, 0.0, 0.0, 0.0});
  CHECK(fisheye.max_bearing() == Approx(std::tan(1.0 / std::sqrt(0.75))));
  const Lens rational(LensModel::kRadialTangential, {0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0});
  CHECK(rational.max_bearing() == Approx(1.0));  // r / (1 + r^2)
  const Lens omni(LensModel::kOmnidirectional, {1.0, -1.0, 0.0, 0.0, 0.0});
  const double m = 1.0 / std::sqrt(3.0);  // tan of half the angle off the axis
  CHECK(omni.max_bearing() == Approx(std::tan(2.0 * std::atan(m))));
  for (const Lens& lens : {pinhole, fisheye, rational, omni}) {
    CHECK_FALSE(lens.distorted({1.001 * lens.max_bearing(), 0.0}).has_value());
    // Just outside the image of the disc, and far outside.
    const double rim = lens.distorted({0.0, (1.0 - 1e-9) * lens.max_bearing()}).value().y();
    CHECK(lens.undistorted({0.0, 0.999 * rim}).has_value());
    CHECK_FALSE(lens.undistorted({0.0, 1.001 * rim}).has_value());
    CHECK_FALSE(lens.undistorted({1e6, -1e6}).has_value());
  }
}

TEST_CASE("Bearings end at 80 degrees") {
  for (const Lens& lens : {Lens(), kEuroc, kTumVi, kTumViDoubleSphere}) {
    CHECK(lens.max_bearing() == Approx(std::tan(80.0 * M_PI / 180.0)).epsilon(1e-12));
    CHECK(lens.distorted({0.0, std::tan(79.9 * M_PI / 180.0)}).has_value());
    CHECK_FALSE(lens.distorted({0.0, std::tan(80.1 * M_PI / 180.0)}).has_value());
    CHECK_FALSE(lens.distorted({std::nan(""), 0.0}).has_value());
    CHECK_FALSE(lens.undistorted({0.0, std::nan("")}).has_value());
    CHECK_FALSE(lens.undistorted({std::numeric_limits<double>::infinity(), 0.0}).has_value());
  }
  // TUM-VI's corners see beyond the disc; the middle of its image's sides does not.
  CHECK_FALSE(kTumVi.undistorted({256.0 / 190.97, 256.0 / 190.97}).has_value());
  CHECK(kTumVi.undistorted({256.0 / 190.97, 0.0}).has_value());
}

TEST_CASE("Invalid coefficients of a lens are refused") {
  const auto refuses = [](LensModel model, const std::vector<double>& k) {
    CHECK_THROWS_AS(Lens(model, k), std::invalid_argument);
  };
  refuses(LensModel::kRadialTangential, {0.1, 0.1, 0.0});
  refuses(LensModel::kRadialTangential, {0.1, 0.1, 0.0, 0.0, 0.0, 0.0});
  refuses(LensModel::kEquidistant, {0.1, 0.1, 0.0, 0.0, 0.0});
  refuses(LensModel::kEquidistant, {0.1, std::nan(""), 0.0, 0.0});
  refuses(LensModel::kOmnidirectional, {-0.1, 0.1, 0.0, 0.0, 0.0});
  refuses(LensModel::kDoubleSphere, {-1.0, 0.5});
  refuses(LensModel::kDoubleSphere, {0.0, 1.1});
  refuses(LensModel::kDoubleSphere, {0.0, 0.6, 0.0});
}

}  // namespace
}  // namespace km
