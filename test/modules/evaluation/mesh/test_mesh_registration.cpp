#include "modules/core/geometry/lie.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// The report of mesh_error() with registration.
MeshReport report_of(const LabelledMesh& truth, const LabelledMesh& estimate,
                     const SE3& guess = SE3::Identity()) {
  const std::vector<MeshInput> inputs = {{"estimate", estimate}};
  MeshErrorOptions options{.T_truth_estimate = guess};
  return mesh_error(truth, inputs, options);
}

// Largest distance [m] between the points of a room moved by `found` and by `truth`.
double difference(const SE3& found, const SE3& truth) {
  double worst = 0.0;
  for (const Eigen::Vector3f& vertex : room().vertices) {
    const Eigen::Vector3d point = vertex.cast<double>();
    worst = std::max(worst, (found * point - truth * point).norm());
  }
  return worst;
}

constexpr double kError_m = 5e-5;  // a few of the steps at which registration stops

}  // namespace

TEST_CASE("Registration finds the motion of a room") {
  Vector6 xi;
  xi << GENERATE(-0.04, 0.0, 0.05), 0.02, -0.03, 0.10, GENERATE(-0.08, 0.12), 0.05;
  const SE3 T_truth_estimate = se3_exp(xi);
  LabelledMesh estimate = room();
  estimate.transform(T_truth_estimate.inverse());
  const Registration found = report_of(room(), estimate).registration;
  CHECK(found.converged);
  CHECK(found.free_directions == 0);
  CHECK(difference(found.T_truth_estimate, T_truth_estimate) < kError_m);
}

TEST_CASE("Registration does not move along undetermined directions") {
  LabelledMesh estimate = square(4.0F, 0.0F);
  estimate.transform(make_pose(Eigen::Matrix3d::Identity(), {0.3, 0.0, 0.05}));
  const MeshReport report = report_of(square(4.0F, 0.0F), estimate);
  CHECK(report.registration.free_directions == 3);
  const SE3 expected = make_pose(Eigen::Matrix3d::Identity(), {0.0, 0.0, -0.05});
  CHECK(difference(report.registration.T_truth_estimate, expected) < kError_m);
  REQUIRE(report.notes.size() >= 1);
  CHECK(report.notes[0] ==
        "the surfaces leave 3 of 6 directions open; registration did not move along these");
}

TEST_CASE("Registration is not biased by a part that the truth lacks") {
  LabelledMesh estimate = room();
  estimate.append(square(1.0F, 0.5F));  // a table of 1 m^2 of 41, half a metre above the floor
  const SE3 T_truth_estimate = make_pose(so3_exp({0.0, 0.0, 0.02}), {0.05, -0.05, 0.03});
  estimate.transform(T_truth_estimate.inverse());
  const Registration found = report_of(room(), estimate).registration;
  CHECK(difference(found.T_truth_estimate, T_truth_estimate) < kError_m);
}

// Rough ground whose rim extends beyond a kerb, which is then the nearest face.
TEST_CASE("Registration does not pair ground beside a kerb with the kerb") {
  const LabelledMesh ground = square(8.0F, 0.0F, 16);
  LabelledMesh upright = rectangle({2, 0, 0}, {0, 8, 0}, {0, 0, 0.3F}, 32);  // the kerb
  upright.append(rectangle({8, 0, 0}, {0, 8, 0}, {0, 0, 1}));
  upright.append(rectangle({0, 8, 0}, {8, 0, 0}, {0, 0, 1}));
  LabelledMesh truth = ground;
  truth.append(upright);
  LabelledMesh estimate = ground;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> height(-0.1F, 0.1F);
  for (Eigen::Vector3f& vertex : estimate.vertices) vertex.z() += height(random);
  estimate.append(upright);
  estimate.append(rectangle({1.9F, 0, 0.15F}, {0.1F, 0, 0}, {0, 8, 0}));
  const SE3 found = report_of(truth, estimate).registration.T_truth_estimate;
  const Eigen::Vector3d middle(5.0, 4.0, 0.3);  // rough ground tilts the map a little
  CHECK(std::abs((found * middle - middle).x()) < 1e-3);
}

TEST_CASE("A large move is noted") {
  LabelledMesh estimate = room();
  estimate.transform(make_pose(Eigen::Matrix3d::Identity(), {0.6, 0.0, 0.0}));
  const MeshReport report = report_of(room(), estimate);
  REQUIRE_FALSE(report.notes.empty());
  CHECK_THAT(report.notes[0], StartsWith("registration moved the estimate by up to 0.6"));
}

}  // namespace km
