#include <catch2/catch.hpp>
#include <string>

#include "modules/images/image_codec.hpp"
#include "modules/images/keypoint_extractor.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

CommandResult run_tool(const std::string& arguments) {
  return run_command(std::string(KM_BIN_DIR) + "/kimera_multi_vocabulary " + arguments);
}

// checks.md L5 on real images, through the tool.
TEST_CASE("The tool trains on real images and distinguishes the two places",
          "[place_recognition]") {
  const auto images = shared_data("kimera_vio_lcd");
  if (!images) return;
  const TemporaryFolder folder;
  const auto left = [&](int i) {
    return (*images / ("left_img_" + std::to_string(i) + ".png")).string();
  };
  const std::string vocabulary = (folder.path() / "v.kmvoc").string();
  const CommandResult trained = run_tool("train -k 9 -L 3 -o " + vocabulary + " " + left(0) + " " +
                                         left(1) + " " + left(2) + " " + left(3));
  INFO(trained.output);
  REQUIRE(trained.exit_code == 0);
  CHECK_THAT(trained.output, Contains("of 4 images"));

  const Vocabulary words = load_vocabulary(vocabulary);
  const auto bag_of = [&](int i) {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    make_keypoint_extractor(1000)->detectAndCompute(read_pixels(left(i), DecodedPixels::kGray),
                                                    cv::noArray(), keypoints, descriptors);
    return words.transform(descriptors_of_rows(descriptors));
  };
  const auto score_of = [&](int i, int k) { return score(bag_of(i), bag_of(k)); };
  CHECK(score_of(2, 2) == Approx(1.0).margin(1e-5));
  // 0, 1 and 2, 3 are pairs of one place each.
  CHECK(score_of(0, 1) > score_of(0, 2));
  CHECK(score_of(2, 3) > score_of(1, 3));
}

TEST_CASE("The tool names unusable input and fails", "[place_recognition]") {
  const TemporaryFolder folder;
  const auto check_fails = [&](const std::string& arguments, const char* reason) {
    const CommandResult run = run_tool(arguments);
    CHECK(run.exit_code != 0);
    CHECK_THAT(run.output, Contains(reason));
  };
  const std::string at = folder.path().string();
  check_fails("train -o " + at + "/v /nowhere", "/nowhere does not exist");
  check_fails("train -o " + at + "/v " + at, "holds no image");
  folder.write("broken.png", "no image");
  check_fails("train -o " + at + "/v " + at, "broken.png: neither a PNG nor a JPEG file");
  check_fails("train -k 1 -o " + at + "/v " + at + "/broken.png", "branching = 1 is outside");
  check_fails("", "subcommand is required");
}

}  // namespace
}  // namespace km
