#include <catch2/catch.hpp>
#include <cstdio>
#include <ctime>
#include <opencv2/core/utility.hpp>

#include "depth_check.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/support/shared_data.hpp"

// Time and accuracy of stereo depth on MH_01's pairs, 752 x 480, on one thread. Times are CPU time,
// which hardly depends on the load of the machine.

namespace km {
namespace {

struct Case {
  int downscale = 1;
  double min_depth_m = 0.6;
};

double cpu_ms() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void measure(const std::filesystem::path& folder, const Case& one) {
  EurocReader reader = open_euroc(folder, {.from_s = 0.0, .to_s = 15.0});
  const StereoRig& rig = reader.rig().stereo;
  StereoDepth stereo(rig, {.downscale = one.downscale, .min_depth_m = one.min_depth_m});
  DepthDifferences differences;
  std::vector<double> times_ms, shares;
  for (int i = 0; auto packet = reader.next(); ++i) {
    if (i % 10 != 0) continue;
    const StereoFrame& frame = *packet->frame;
    const double start_ms = cpu_ms();
    const DepthImage depth = stereo.compute(frame.left, frame.right);
    times_ms.push_back(cpu_ms() - start_ms);
    const auto none = std::count(depth.millimetres.begin(), depth.millimetres.end(), 0);
    shares.push_back(1.0 -
                     static_cast<double>(none) / static_cast<double>(depth.millimetres.size()));
    add_differences(depth, stereo, rig, triangulated_corners(frame, rig), differences);
  }
  std::printf(
      "  1/%d %3d px | %5.1f ms | %4.1f %% of pixels | %.2f px, %.2f %% (%zu corners, "
      "%.0f %% with depth)\n",
      one.downscale, stereo.disparities(), median_of(times_ms), 1e2 * median_of(shares),
      median_of(differences.px), 1e2 * median_of(differences.relative), differences.corners,
      1e2 * static_cast<double>(differences.px.size()) /
          static_cast<double>(std::max<std::size_t>(differences.corners, 1)));
}

TEST_CASE("Stereo depth on MH_01", "[!benchmark]") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  cv::setNumThreads(1);
  std::printf("size, disparities | CPU | with depth | median difference to corners\n");
  for (const Case& one : {Case{}, Case{2}, Case{1, 0.35}, Case{2, 0.35}}) measure(*folder, one);
}

}  // namespace
}  // namespace km
