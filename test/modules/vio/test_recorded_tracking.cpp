#include <catch2/catch.hpp>

#include "recorded_tracking.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

TEST_CASE("Five seconds of MH_01_easy are tracked as well as measured", "[vio]") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  const Recording recording = read_recording(*folder, 2.0, 7.0);
  const TrackingRun run = run_tracker(recording, TrackerConfig{});

  double stereo_share = 0.0;
  for (const TrackedFrame& frame : run.frames) {
    const auto matched = std::count_if(frame.features.begin(), frame.features.end(),
                                       [](const auto& f) { return f.right.has_value(); });
    CHECK(frame.features.size() >= 150);
    stereo_share += static_cast<double>(matched) / static_cast<double>(frame.features.size());
  }
  stereo_share /= static_cast<double>(run.frames.size());
  // About a tenth beyond the measurements on all 15 s; these 5 s are calmer.
  CHECK(stereo_share > 0.5);                               // 0.59
  CHECK(survival(run, 1) > 0.93);                          // 0.942
  CHECK(survival(run, 10) > 0.62);                         // 0.69
  CHECK(epipolar_errors(recording, run).median_px < 0.3);  // 0.22 px
  const ReprojectionErrors next = reprojection_errors(recording, run, 1);
  CHECK(next.fitted_left.median_px < 0.15);       // 0.123 px
  CHECK(next.fitted_left.outlier_share < 0.004);  // 0.002
  CHECK(next.left.median_px < 0.4);               // 0.29 px
  CHECK(next.left.outlier_share < 0.01);          // 0.003
}

}  // namespace
}  // namespace km
