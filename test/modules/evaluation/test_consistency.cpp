#include <Eigen/Cholesky>

#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/evaluation/consistency.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// A chain of poses with independent steps; the estimate has the stated noise times `factor`.
struct Chain {
  std::vector<StampedPose> truth, estimate;
  std::vector<Matrix6> covariances;

  Chain(unsigned seed, double factor) {
    std::mt19937 rng(seed);
    Matrix6 step = Matrix6::Zero();
    step.diagonal() << 1e-4, 4e-4, 2e-4, 1e-2, 2e-2, 3e-2;
    const Matrix6 L = step.llt().matrixL();
    const SE3 T_truth_world = random_pose(rng, 3.0);
    SE3 true_pose = random_pose(rng, 3.0);
    UncertainPose estimated{T_truth_world.inverse() * true_pose, Matrix6::Zero()};
    for (Stamp k = 0; k < 100; ++k) {
      truth.push_back({k * 1'000'000'000, true_pose});
      estimate.push_back({k * 1'000'000'000, estimated.T});
      covariances.push_back(estimated.Sigma);
      const SE3 motion = random_pose(rng, 0.2);
      true_pose = true_pose * motion;
      const Vector6 noise = factor * (L * random_vector<6>(rng));
      estimated = compose(estimated, {motion * se3_exp(noise), step});
    }
  }
  [[nodiscard]] ConsistencyInput input() const { return {"chain", truth, estimate, covariances}; }
};

TEST_CASE("The NEES of right covariances is 1, and grows with the square of the errors") {
  for (const double factor : {1.0, 2.0}) {
    double pose = 0.0, within = 0.0;
    constexpr unsigned kRuns = 200;
    for (unsigned seed = 0; seed < kRuns; ++seed) {
      const Chain chain(seed, factor);
      const std::vector<ConsistencyInput> inputs{chain.input()};
      const auto results = consistency(inputs, false);
      REQUIRE(results.size() == 2);
      CHECK(results.back().poses == 99);  // all but the origin
      pose += results.back().pose / kRuns;
      within += results.back().share_within_95 / kRuns;
    }
    CAPTURE(factor);
    // The covariance is of first order; errors of the rotation reach 0.2 rad.
    CHECK(pose == Approx(factor * factor).epsilon(0.1));
    if (factor == 1.0) CHECK(within == Approx(0.95).margin(0.02));
    if (factor == 2.0) CHECK(within < 0.7);
  }
}

TEST_CASE("Poses with covariances are read as they are written") {
  const Chain chain(3, 1.0);
  TemporaryFolder folder;
  std::string text;
  for (std::size_t k = 0; k < chain.estimate.size(); ++k) {
    const SE3& T = chain.estimate[k].T;
    const Eigen::Quaterniond q(T.linear());
    std::ostringstream row;
    row.precision(17);
    row << k << ' ' << T.translation().transpose() << ' ' << q.coeffs().transpose();
    const Matrix6 along_axes = along_fixed_axes({T, chain.covariances[k]});
    for (const double x : along_axes.reshaped()) row << ' ' << x;
    text += row.str() + '\n';
  }
  const UncertainTrajectory read = read_uncertain_trajectory(folder.write("poses.tum", text));
  REQUIRE(read.poses.size() == chain.estimate.size());
  for (std::size_t k = 0; k < read.poses.size(); ++k)
    CHECK((read.covariances[k] - chain.covariances[k]).norm() <
          1e-12 * (1.0 + chain.covariances[k].norm()));
  CHECK_THROWS_WITH(read_uncertain_trajectory(folder.write("bare.tum", "1 0 0 0 0 0 0 1\n")),
                    Catch::Matchers::Contains("bare.tum line 1: 8 fields, expected 44"));
}

}  // namespace
}  // namespace km
