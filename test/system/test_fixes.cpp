#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/system/team_run.hpp"

// A robot with positions of a motion capture, on a recording.

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kSigma_m = 0.05;

// Writes ten positions of each second of the truth, with noise. Every fifth is off by 2 m.
void write_fixes(const std::vector<StampedPose>& truth, const fs::path& file) {
  std::mt19937 rng(5);
  std::normal_distribution<double> normal;
  std::ofstream out(file);
  out.precision(20);
  for (std::size_t k = 0; k < truth.size(); k += 20) {
    Eigen::Vector3d p = truth[k].T.translation();
    Eigen::Vector3d outlier;
    for (double& c : p) c += kSigma_m * normal(rng);
    for (double& c : outlier) c = normal(rng);
    if ((k / 20) % 5 == 0) p += 2.0 * outlier.normalized();
    out << truth[k].stamp << ", " << p.x() << ", " << p.y() << ", " << p.z() << '\n';
  }
}

// Root mean square distance from the truth, without an alignment.
double error_m(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth) {
  double sum = 0.0;
  for (const StampedPose& pose : estimate) {
    const auto at = std::ranges::lower_bound(truth, pose.stamp, {}, &StampedPose::stamp);
    REQUIRE(at != truth.end());
    sum += (pose.T.translation() - at->T.translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

TEST_CASE("fixes of a motion capture place a run in its frame", "[system][fixes]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const auto truth =
      read_trajectory(*dataset / "mav0/state_groundtruth_estimate0/groundtruth_tum.txt");
  write_fixes(truth, folder.path() / "fixes.csv");
  Process robot(words_of(
      KM_BIN_DIR "/kimera_multi_robot --config config/datasets/euroc.yaml --robot 0 --dataset " +
      dataset->string() + " --to 12 --rate max --domain " + std::to_string(random_domain()) +
      " --output " + (folder.path() / "run").string() +
      " --set absolute_fixes.source=motion_capture absolute_fixes.sigma_m=" +
      std::to_string(kSigma_m) + " absolute_fixes.file=" + (folder.path() / "fixes.csv").string()));
  REQUIRE(robot.wait() == 0);
  const RunSummary summary = read_summary(folder.path() / "run/summary.json");
  REQUIRE(summary.fixes);
  CAPTURE(summary.fixes->used, summary.fixes->rejected, summary.fixes->rotation_sigma_rad);
  CHECK(summary.fixes->located);
  CHECK(summary.fixes->rejected > 0);
  CHECK(summary.fixes->used > 2 * summary.fixes->rejected);
  const auto estimate = read_trajectory(folder.path() / "run/optimized.tum");
  // Half the distance of a single fix, 1.7 sigmas: some 20 fixes determine six unknowns.
  CHECK(error_m(estimate, truth) < 0.87 * kSigma_m);
}

}  // namespace
}  // namespace km
