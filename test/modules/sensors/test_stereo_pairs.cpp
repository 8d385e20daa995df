#include "modules/sensors/stereo_pairs.hpp"

#include <catch2/catch.hpp>

#include "modules/sensors/euroc_rig.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/shared_data.hpp"

namespace km {

TEST_CASE("Keyframes listed in pairs.csv load as stereo pairs", "[sensors]") {
  const EurocFolder folder;
  folder.write_image("7_0.png", 32, 24, 50);
  folder.write_image("7_1.png", 32, 24, 60);
  folder.write("pairs.csv", "#timestamp [ns],left,right\n7,7_0.png,7_1.png\n7,a,b\n9,9_0.png\n");
  ReaderReport report;
  const auto pairs = list_keyframe_pairs(folder.mav0(), report);
  REQUIRE(pairs.size() == 1);
  CHECK(report.count(ReaderFault::kRepeatedStamp) == 1);
  CHECK(report.count(ReaderFault::kMalformedRow) == 1);
  const auto loaded = load_stereo_pair(pairs[0], read_euroc_rig(folder.mav0()).stereo);
  REQUIRE(loaded.status == ImageStatus::kOk);
  CHECK(loaded.frame.stamp == 7);
  CHECK(loaded.frame.left.pixels.front() == 50);
  CHECK(loaded.frame.right.pixels.front() == 60);
}

TEST_CASE("V1_01_easy: all 100 keyframes load with the rig of the recording", "[sensors]") {
  const auto folder = shared_data("euroc/V1_01_easy");
  if (!folder) return;
  ReaderReport report;
  const StereoRig rig = read_euroc_rig(*folder / "mav0").stereo;
  const auto pairs = list_keyframe_pairs(*folder / "keyframes", report);
  REQUIRE(pairs.size() == 100);
  CHECK(report.empty());
  for (const StereoPairFile& pair : pairs) {
    const auto loaded = load_stereo_pair(pair, rig);
    CAPTURE(loaded.problem);
    CHECK(loaded.status == ImageStatus::kOk);
  }
}

}  // namespace km
