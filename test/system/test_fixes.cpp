#include "modules/absolute_fixes/geodetic.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"
#include "test/system/live_run.hpp"
#include "test/system/team_run.hpp"

// Robots with positions of GNSS or of a motion capture, on a recording and on live topics.

namespace km {
namespace {

constexpr double kSigma_m = 0.05;

// Half the distance of a single fix, 1.7 sigmas: some 20 fixes determine six unknowns.
constexpr double kLargest_m = 0.87 * kSigma_m;

const GeodeticPoint kDatum{47.3977, 8.5456, 488.0};

// The point at `p_enu` [m] about kDatum. Newton steps with the axes of a sphere: the error falls by
// the flattening of the ellipsoid, 1/300, in each step.
GeodeticPoint geodetic(const Eigen::Vector3d& p_enu) {
  constexpr double kEarth_m = 6.37e6, kDegree = M_PI / 180.0;
  const EnuFrame frame(kDatum);
  GeodeticPoint point = kDatum;
  for (int k = 0; k < 10; ++k) {
    const Eigen::Vector3d off = p_enu - frame.position_of(point);
    point.longitude_deg += off.x() / (kEarth_m * std::cos(kDatum.latitude_deg * kDegree)) / kDegree;
    point.latitude_deg += off.y() / kEarth_m / kDegree;
    point.altitude_m += off.z();
  }
  return point;
}

// Writes ten positions of each second of the truth, with noise. Every seventh, except for the first
// one, is off by 2 m: keyframes that are half a second apart do not all meet such positions.
void write_fixes(const std::vector<StampedPose>& truth, const fs::path& file,
                 bool is_gnss = false) {
  std::mt19937 rng(5);
  std::normal_distribution<double> normal;
  std::ofstream out(file);
  out.precision(20);
  for (std::size_t k = 0; k < truth.size(); k += 20) {
    Eigen::Vector3d p = truth[k].T.translation();
    Eigen::Vector3d outlier;
    for (double& c : p) c += kSigma_m * normal(rng);
    for (double& c : outlier) c = normal(rng);
    if (k > 0 && (k / 20) % 7 == 0) p += 2.0 * outlier.normalized();
    const GeodeticPoint point = geodetic(p);
    if (is_gnss) p = {point.latitude_deg, point.longitude_deg, point.altitude_m};
    out << truth[k].stamp << ", " << p.x() << ", " << p.y() << ", " << p.z() << '\n';
  }
}

// Differences of the truth from the estimate, without an alignment.
std::vector<Eigen::Vector3d> errors_m(const std::vector<StampedPose>& estimate,
                                      const std::vector<StampedPose>& truth) {
  REQUIRE_FALSE(estimate.empty());
  std::vector<Eigen::Vector3d> errors;
  for (const StampedPose& pose : estimate) {
    const auto at = std::ranges::lower_bound(truth, pose.stamp, {}, &StampedPose::stamp);
    REQUIRE(at != truth.end());
    errors.push_back(at->T.translation() - pose.T.translation());
  }
  return errors;
}

// Root mean square distance from the truth if the origin of the estimate is at `origin`.
double error_m(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth,
               const Eigen::Vector3d& origin = Eigen::Vector3d::Zero()) {
  double sum = 0.0;
  const std::vector<Eigen::Vector3d> errors = errors_m(estimate, truth);
  for (const Eigen::Vector3d& error : errors) sum += (error - origin).squaredNorm();
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

// The datum of an estimate: mean difference of the truth.
Eigen::Vector3d datum_of(const std::vector<StampedPose>& estimate,
                         const std::vector<StampedPose>& truth) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const std::vector<Eigen::Vector3d> errors = errors_m(estimate, truth);
  for (const Eigen::Vector3d& error : errors) sum += error;
  return sum / static_cast<double>(errors.size());
}

std::vector<StampedPose> truth_of(const fs::path& dataset) {
  return read_trajectory(dataset / "mav0/state_groundtruth_estimate0/groundtruth_tum.txt");
}

// A robot on a part of the recording, with the fixes of a motion capture.
std::vector<std::string> command_of(const fs::path& dataset, int robot, const std::string& part,
                                    int domain, const TemporaryFolder& folder,
                                    const std::string& settings = {}) {
  return words_of(euroc_robot(
      robot,
      "--dataset " + dataset.string() + ' ' + part + " --rate max --output " +
          (folder.path() / robot_name(robot)).string() +
          " --set absolute_fixes.source=motion_capture absolute_fixes.sigma_m=" +
          std::to_string(kSigma_m) +
          " absolute_fixes.file=" + (folder.path() / "fixes.csv").string() + ' ' + settings,
      domain));
}

// Root mean square distance of the poses that two robots have at the same images of one recording.
double apart_m(const std::vector<StampedPose>& one, const std::vector<StampedPose>& other) {
  double sum = 0.0;
  int common = 0;
  for (const StampedPose& pose : one) {
    const auto at = std::ranges::lower_bound(other, pose.stamp, {}, &StampedPose::stamp);
    if (at == other.end() || at->stamp != pose.stamp) continue;
    sum += (pose.T.translation() - at->T.translation()).squaredNorm();
    ++common;
  }
  REQUIRE(common > 50);
  return std::sqrt(sum / common);
}

TEST_CASE("two robots with fixes are in one frame with and without closures between them",
          "[fixes]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const auto truth = truth_of(*dataset);
  write_fixes(truth, folder.path() / "fixes.csv");
  const bool has_closures = GENERATE(false, true);
  // No keyframes have so many inliers.
  const std::string closures = has_closures ? "" : "loop_closure.min_inliers=1000";
  const int domain = random_domain();
  Process first(command_of(*dataset, 0, "--to 12 --serve-limit 100", domain, folder, closures));
  Process second(
      command_of(*dataset, 1, "--from 5 --to 17 --serve-limit 100", domain, folder, closures));
  REQUIRE(first.wait() == 0);
  REQUIRE(second.wait() == 0);
  std::vector<std::vector<StampedPose>> poses;
  std::uint64_t inliers = 0;
  for (const int robot : {0, 1}) {
    const fs::path results = folder.path() / robot_name(robot);
    const RunSummary summary = read_summary(results / "summary.json");
    REQUIRE(summary.fixes);
    CHECK(summary.fixes->located);
    CHECK(summary.fixes->rejected > 0);
    CHECK(summary.fixes->used > 2 * summary.fixes->rejected);
    inliers += summary.closures.inliers;
    poses.push_back(read_trajectory(results / "optimized.tum"));
  }
  CHECK((inliers > 0) == has_closures);
  const double first_m = error_m(poses[0], truth), second_m = error_m(poses[1], truth);
  const double between_m = apart_m(poses[0], poses[1]);
  CAPTURE(has_closures, first_m, second_m, between_m);
  CHECK(first_m < kLargest_m);
  CHECK(second_m < kLargest_m);
  // Without closures the errors of both add up. With closures the robots fit to each other.
  CHECK(between_m < (has_closures ? 0.5 : M_SQRT2) * kLargest_m);
}

// A robot on live topics with the names of EuRoC, and fixes on /fix.
std::vector<std::string> live_command(const fs::path& dataset, const TemporaryFolder& folder,
                                      int ros_domain, const std::string& output,
                                      const std::string& settings) {
  const fs::path rig = folder.write("rig.yaml", euroc_rig(dataset));
  return logged(words_of(euroc_robot(
      0, "--live " + rig.string() + " --serve-limit 0 " + output + ' ' +
             (folder.path() / "live").string() +
             " --set ros.interface=lo sensors.max_lag_s=30 ros.domain=" +
             std::to_string(ros_domain) + " absolute_fixes.topic=/fix absolute_fixes.sigma_m=" +
             std::to_string(kSigma_m) + ' ' + settings)));
}

// Options of a driver that plays the recording `rate` times as fast as it was recorded.
std::string at_rate(double rate) {
  return "--reliable --rate " + std::to_string(rate) + ' ';
}

// A busy host loses messages, and the result then depends on which ones: a test repeats the run
// more slowly until all messages have arrived.
constexpr std::array kRates = {0.7, 0.35, 0.17, 0.08};

bool has_lost_messages(const RunSummary& summary) {
  return summary.sensor_faults.contains("messages lost on the way");
}

constexpr double kNearTheEnd_s = 11.0;

TEST_CASE("fixes on live topics place a run in their frame", "[fixes]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const auto truth = truth_of(*dataset);
  const bool is_gnss = GENERATE(true, false);
  CAPTURE(is_gnss);
  const fs::path fixes = folder.path() / "fixes.csv";
  write_fixes(truth, fixes, is_gnss);
  RunSummary summary;
  for (const double rate : kRates) {
    const int ros_domain = random_domain();
    Process robot(live_command(*dataset, folder, ros_domain, "--output",
                               is_gnss
                                   ? "absolute_fixes.source=gnss absolute_fixes.correlation_s=0 "
                                     "absolute_fixes.datum=[47.3977,8.5456,488]"
                                   : "absolute_fixes.source=motion_capture "
                                     "absolute_fixes.live_type=geometry_msgs/msg/PoseStamped"));
    Process driver(
        driver_command(*dataset, ros_domain,
                       at_rate(rate) + "--to 12.5 --fixes " + fixes.string() +
                           (is_gnss ? "" : " --fix-type geometry_msgs/msg/PoseStamped")));
    CHECK(driver.wait() == 0);
    REQUIRE(robot.wait_until(is_beyond(kNearTheEnd_s)));
    robot.kill(SIGINT);
    REQUIRE(robot.wait() == 0);
    summary = read_summary(folder.path() / "live/summary.json");
    if (!has_lost_messages(summary)) break;
  }
  REQUIRE(summary.fixes);
  CAPTURE(summary.fixes->used, summary.fixes->rejected, summary.fixes->received);
  CHECK(summary.fixes->located);
  CHECK(summary.fixes->used > 2 * summary.fixes->rejected);
  CHECK(error_m(read_trajectory(folder.path() / "live/optimized.tum"), truth) < kLargest_m);
}

bool is_located(const std::string& line) {
  return line.find("located after") != line.npos;
}

// The datum is the first fix that arrives, whichever it is. It is that of the second process, too,
// which receives none, or later ones: with another datum its fixes would contradict the first ones.
TEST_CASE("a killed and resumed robot remains located by its live fixes", "[fixes]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const auto truth = truth_of(*dataset);
  const fs::path fixes = folder.path() / "fixes.csv";
  write_fixes(truth, fixes, true);
  const bool has_more_fixes = GENERATE(false, true);
  CAPTURE(has_more_fixes);
  const std::string settings = "absolute_fixes.source=gnss absolute_fixes.correlation_s=0";
  RunSummary summary;
  for (const double rate : kRates) {
    const int ros_domain = random_domain();
    {
      Process robot(live_command(*dataset, folder, ros_domain, "--output", settings));
      Process driver(driver_command(*dataset, ros_domain,
                                    at_rate(rate) + "--to 13 --fixes " + fixes.string()));
      REQUIRE(robot.wait_until(is_located));
      robot.kill(SIGKILL);
      robot.wait();
      driver.kill(SIGINT);
      CHECK(driver.wait() == 0);
    }
    Process robot(live_command(*dataset, folder, ros_domain, "--resume", settings));
    Process driver(driver_command(
        *dataset, ros_domain,
        at_rate(rate) + "--to 13" + (has_more_fixes ? " --fixes " + fixes.string() : "")));
    CHECK(driver.wait() == 0);
    REQUIRE(robot.wait_until(is_beyond(kNearTheEnd_s)));
    robot.kill(SIGINT);
    REQUIRE(robot.wait() == 0);
    summary = read_summary(folder.path() / "live/summary.json");
    if (!has_lost_messages(summary)) break;
  }
  REQUIRE(summary.fixes);
  CHECK(summary.fixes->located);
  CAPTURE(summary.fixes->used, summary.fixes->rejected, summary.fixes->received);
  CHECK((summary.fixes->received > 0) == has_more_fixes);
  const auto estimate = read_trajectory(folder.path() / "live/optimized.tum");
  CHECK(error_m(estimate, truth, datum_of(estimate, truth)) <
        (has_more_fixes ? 1.0 : 2.0) * kLargest_m);
}

}  // namespace
}  // namespace km
