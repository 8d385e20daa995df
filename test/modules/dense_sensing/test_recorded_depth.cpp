#include <catch2/catch.hpp>

#include "depth_check.hpp"
#include "modules/sensors/euroc_reader.hpp"
#include "modules/sensors/euroc_rig.hpp"
#include "modules/sensors/stereo_pairs.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

// What remains between two ways of matching with the same calibration.
constexpr double kMaxMedian_px = 0.35;
constexpr double kMinShare = 0.75;  // of the corners with dense depth

void check(const DepthDifferences& differences) {
  CAPTURE(differences.corners, differences.px.size());
  REQUIRE(differences.corners > 300);
  CHECK(static_cast<double>(differences.px.size()) >
        kMinShare * static_cast<double>(differences.corners));
  CHECK(median_of(differences.px) < kMaxMedian_px);
}

TEST_CASE("Dense depth agrees with triangulated corners on MH_01", "[stereo_depth][recorded]") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  EurocReader reader(*folder, {.from_s = 0.0, .to_s = 15.0});
  const StereoRig& rig = reader.rig().stereo;
  StereoDepth stereo(rig, {.downscale = GENERATE(1, 2)});
  DepthDifferences differences;
  for (int i = 0; auto packet = reader.next(); ++i) {
    if (i % 30 != 0) continue;
    const StereoFrame& frame = *packet->frame;
    add_differences(stereo.compute(frame.left, frame.right), stereo, rig,
                    triangulated_corners(frame, rig), differences);
  }
  check(differences);
}

TEST_CASE("Dense depth agrees with triangulated corners on V1_01", "[stereo_depth][recorded]") {
  const auto folder = shared_data("euroc/V1_01_easy");
  if (!folder) return;
  const StereoRig rig = read_euroc_rig(*folder / "mav0").stereo;
  ReaderReport report;
  const auto files = list_keyframe_pairs(*folder / "keyframes", report);
  StereoDepth stereo(rig, {});
  DepthDifferences differences;
  for (std::size_t i = 0; i < files.size(); i += 10) {
    const StereoPairResult pair = load_stereo_pair(files[i], rig);
    REQUIRE(pair.status == ImageStatus::kOk);
    add_differences(stereo.compute(pair.frame.left, pair.frame.right), stereo, rig,
                    triangulated_corners(pair.frame, rig), differences);
  }
  check(differences);
}

}  // namespace
}  // namespace km
