#include <catch2/catch.hpp>

#include "modules/loop_closure/ransac.hpp"

namespace km {
namespace {

// A number that most of the data agree on.
struct ConstantProblem {
  static constexpr std::size_t kSampleSize = 1;
  std::vector<double> data;

  std::size_t size() const { return data.size(); }
  std::size_t drawable() const { return data.size(); }
  std::optional<double> solve(std::span<const std::size_t> sample) const { return data[sample[0]]; }
  double error(double model, std::size_t i) const {
    return (data[i] - model) * (data[i] - model);  // inlier within 1
  }
  std::optional<double> polish(double, std::span<const std::size_t> inliers) const {
    double sum = 0.0;
    for (const std::size_t i : inliers) sum += data[i] / static_cast<double>(inliers.size());
    return sum;
  }
};

TEST_CASE("RANSAC returns the model of the largest agreement", "[ransac]") {
  const ConstantProblem problem{{5.0, 5.2, 4.8, 5.1, 4.9, 40.0, -3.0, 17.0, 17.3}};
  const auto seed = GENERATE(range(1U, 11U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const RansacResult<double> result = ransac<double>(problem, {0.999999, 1000}, rng);
  REQUIRE(result.model);
  CHECK(*result.model == Approx(5.0));
  CHECK(result.inliers == std::vector<std::size_t>{0, 1, 2, 3, 4});
  CHECK(result.cost == Approx(0.1 + 4.0));  // squares of the inliers, 1 for each outlier
}

TEST_CASE("RANSAC stops as soon as its confidence allows", "[ransac]") {
  const ConstantProblem problem{std::vector<double>(20, 3.0)};
  std::mt19937 rng(1);
  CHECK(ransac<double>(problem, {0.99, 1000}, rng).iterations == 1);
}

TEST_CASE("RANSAC without data has no model", "[ransac]") {
  std::mt19937 rng(1);
  const RansacResult<double> result = ransac<double>(ConstantProblem{}, {}, rng);
  CHECK_FALSE(result.model);
  CHECK(result.iterations == 0);
}

}  // namespace
}  // namespace km
