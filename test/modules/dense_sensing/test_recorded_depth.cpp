#include <catch2/catch.hpp>

#include "depth_check.hpp"
#include "modules/sensors/frame_files.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

// Largest difference between two methods of matching with the same calibration.
constexpr double kMaxMedian_px = 0.35;
constexpr double kMinShare = 0.75;  // least share of the corners with dense depth

// Checks every `every`-th pair.
void check(const std::vector<StereoPairFile>& pairs, const StereoRig& rig, std::size_t every,
           const StereoDepthConfig& config) {
  StereoDepth stereo(rig, config);
  DepthDifferences differences;
  for (std::size_t i = 0; i < pairs.size(); i += every) {
    const StereoPairResult pair = load_stereo_pair(pairs[i], rig);
    REQUIRE(pair.status == ImageStatus::kOk);
    add_differences(stereo.compute(pair.frame.left, pair.frame.right), stereo, rig,
                    triangulated_corners(pair.frame, rig), differences);
  }
  CAPTURE(differences.corners, differences.px.size());
  REQUIRE(differences.corners > 300);
  CHECK(static_cast<double>(differences.px.size()) >
        kMinShare * static_cast<double>(differences.corners));
  CHECK(median_of(differences.px) < kMaxMedian_px);
}

TEST_CASE("Dense depth agrees with triangulated corners on MH_01", "[stereo_depth][recorded]") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  ReaderReport report;
  auto pairs = list_euroc_pairs(*folder / "mav0", 0.001, report).pairs;
  pairs.resize(300);  // 15 s
  check(pairs, read_euroc_rig(*folder / "mav0").stereo, 30, {.downscale = GENERATE(1, 2)});
}

TEST_CASE("Dense depth agrees with triangulated corners on V1_01", "[stereo_depth][recorded]") {
  const auto folder = shared_data("euroc/V1_01_easy");
  if (!folder) return;
  ReaderReport report;
  check(list_keyframe_pairs(*folder / "keyframes", report), read_euroc_rig(*folder / "mav0").stereo,
        10, {});
}

}  // namespace
}  // namespace km
