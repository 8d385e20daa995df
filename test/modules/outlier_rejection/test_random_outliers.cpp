#include <catch2/catch.hpp>

#include "modules/outlier_rejection/random_outliers.hpp"

namespace km {
namespace {

TEST_CASE("Random outliers join keyframes that odometry does not, in their box", "[outliers]") {
  const bool planar = GENERATE(false, true);
  CAPTURE(planar);
  RandomOutlierModel model{.robot = 7, .keyframes = 6, .planar = planar, .half_side_m = 3.0};
  model.covariance *= 0.5;
  std::mt19937 rng(1);
  const auto outliers = random_outliers(500, model, rng);
  REQUIRE(outliers.size() == 500);
  double farthest = 0.0;
  for (const RelativePose& edge : outliers) {
    CHECK(edge.from.robot == 7);
    CHECK(edge.to.robot == 7);
    CHECK(edge.from.index + 1 < edge.to.index);
    CHECK(edge.to.index < 6);
    CHECK(edge.covariance == model.covariance);
    CHECK((edge.T_from_to.linear().transpose() * edge.T_from_to.linear()).isIdentity(1e-12));
    if (planar) CHECK(edge.T_from_to.matrix().row(2).isApprox(Eigen::RowVector4d(0, 0, 1, 0)));
    farthest = std::max(farthest, edge.T_from_to.translation().cwiseAbs().maxCoeff());
  }
  CHECK(farthest <= 3.0);
  CHECK(farthest > 2.9);  // 500 x 2 coordinates: below it with probability 1e-14
}

TEST_CASE("Two keyframes are too few for an outlier", "[outliers]") {
  std::mt19937 rng(1);
  CHECK_THROWS_WITH(random_outliers(1, {.robot = 0, .keyframes = 2}, rng),
                    Catch::Contains("2 keyframes"));
}

}  // namespace
}  // namespace km
