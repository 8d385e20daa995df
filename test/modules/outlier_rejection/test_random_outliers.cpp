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

TEST_CASE("Outliers of one seed are the same, of two seeds are not", "[outliers]") {
  const RandomOutlierModel model{.robot = 0, .keyframes = 100};
  std::mt19937 one(3), same(3), other(4);
  const auto first = random_outliers(20, model, one);
  const auto second = random_outliers(20, model, same);
  const auto third = random_outliers(20, model, other);
  bool all_alike = true;
  for (std::size_t n = 0; n < first.size(); ++n) {
    CHECK(first[n].from == second[n].from);
    CHECK(first[n].T_from_to.matrix() == second[n].T_from_to.matrix());
    all_alike = all_alike && first[n].from == third[n].from;
  }
  CHECK_FALSE(all_alike);
}

TEST_CASE("Two keyframes are too few for an outlier", "[outliers]") {
  std::mt19937 rng(1);
  CHECK_THROWS_WITH(random_outliers(1, {.robot = 0, .keyframes = 2}, rng),
                    Catch::Contains("2 keyframes"));
}

}  // namespace
}  // namespace km
