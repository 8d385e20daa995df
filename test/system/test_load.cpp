#include "modules/core/stamp.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"
#include "test/system/team_run.hpp"

// Processor time and memory of a robot, and the frames it skips if the computer is too slow.

namespace km {
namespace {

CommandResult run_alone(const fs::path& dataset, const fs::path& output,
                        const std::string& options) {
  return run_command(euroc_robot(0, "--serve-limit 0 --interface lo --dataset " + dataset.string() +
                                        " --output " + output.string() + ' ' + options));
}

}  // namespace

TEST_CASE("A robot keeps the memory of a frame for the next one") {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  std::cout << "SKIPPED: sanitizers have an allocator of their own\n";
#else
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "a";
  const CommandResult run = succeeded(run_alone(*dataset, output, "--to 15 --rate max"));
  const RunSummary summary = read_summary(output / "summary.json");
  REQUIRE(summary.frames == 299);
  // The start of the program, its vocabulary and its records cause 84 page faults a frame. To
  // return the memory of each frame to the kernel would cause 3000.
  CHECK(static_cast<double>(summary.process.page_faults) <
        300.0 * static_cast<double>(summary.frames));
#endif
}

TEST_CASE("On an overloaded computer the map skips frames first, then images are skipped evenly") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "a";
  // An image every 2.5 ms: odometry alone takes two to three times as long.
  const CommandResult run = succeeded(run_alone(
      *dataset, output, "--to 15 --rate 20 --set mapping.mode=metric sensors.max_lag_s=0.05"));
  const RunSummary summary = read_summary(output / "summary.json");
  CHECK(summary.frames_skipped > 0);
  REQUIRE(summary.mapping);
  CHECK(summary.mapping->dropped_under_load > 0);
  REQUIRE(summary.odometry);
  CHECK(summary.odometry->divergences == 0);

  const auto map = run.output.find("the processor is too slow: the map gets no new frames");
  const auto images = run.output.find("odometry gets one of");
  CHECK(map != std::string::npos);
  CHECK(map < images);

  // Images are 0.05 s apart, and one pair of the recording is missing.
  const std::vector<StampedPose> poses = read_trajectory(output / "odometry.tum");
  REQUIRE(poses.size() > 60);
  constexpr double kLongest_s = 4 * 0.05 + 0.05 + 1e-3;
  for (std::size_t k = 1; k < poses.size(); ++k)
    CHECK(seconds_between(poses[k - 1].stamp, poses[k].stamp) <= kLongest_s);
}

}  // namespace km
