#include <catch2/catch.hpp>
#include <cstdint>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <string>

#include "modules/images/keypoint_patches.hpp"
#include "modules/images/spread_keypoints.hpp"
#include "modules/loop_closure/keyframe_features_config.hpp"
#include "test/support/command.hpp"
#include "test/support/image_file.hpp"
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

  const auto score_of = [&](int i, int k) {
    const std::filesystem::path json = folder.path() / "score.json";
    const CommandResult run = run_tool("inspect " + vocabulary + " --pair " + left(i) + " " +
                                       left(k) + " --json " + json.string());
    REQUIRE(run.exit_code == 0);
    const std::string text = folder.read("score.json");
    const std::string key = "\"pair_score\":";
    return std::stod(text.substr(text.find(key) + key.size()));
  };
  CHECK(score_of(2, 2) == Approx(1.0).margin(1e-5));
  // 0, 1 and 2, 3 are pairs of one place each.
  CHECK(score_of(0, 1) > score_of(0, 2));
  CHECK(score_of(2, 3) > score_of(1, 3));
}

// A grey image with corners everywhere.
cv::Mat blocks(int width, int height, std::uint64_t seed) {
  cv::Mat small(height / 10, width / 10, CV_8U), image;
  cv::RNG random(seed);
  random.fill(small, cv::RNG::UNIFORM, 0, 256);
  cv::resize(small, image, {width, height}, 0.0, 0.0, cv::INTER_NEAREST);
  return image;
}

// NumPy's format: 6 bytes of magic, 2 of the version, 2 of the header's length, then the records.
TEST_CASE("The tool writes the patches that a robot describes", "[place_recognition]") {
  const TemporaryFolder folder;
  const cv::Mat flat(240, 320, CV_8U, cv::Scalar(90)), textured = blocks(320, 240, 3);
  write_png(folder.path() / "a.png", flat);
  write_png(folder.path() / "b.png", textured);
  const CommandResult run = run_tool("patches " + folder.path().string() + " --features 50 -o " +
                                     (folder.path() / "p.npy").string());
  INFO(run.output);
  REQUIRE(run.exit_code == 0);
  const SpreadKeypoints keypoints =
      spread_keypoints(textured, 50, KeyframeFeaturesConfig().min_contrast);
  REQUIRE(keypoints.corners.size() > 20);
  const std::string count = std::to_string(keypoints.corners.size());
  CHECK_THAT(run.output, Contains(count + " patches of 2 images"));

  const std::string bytes = folder.read("p.npy");
  const std::size_t begin = 10 + static_cast<std::uint8_t>(bytes[8]) +
                            256U * static_cast<std::size_t>(static_cast<std::uint8_t>(bytes[9]));
  CHECK(bytes.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
  CHECK(begin % 64 == 0);
  CHECK_THAT(bytes.substr(0, begin), Contains("'shape': (" + count + ",)"));
  const cv::Mat patches = keypoint_patches(textured, keypoints.corners);
  std::string expected;
  for (std::size_t i = 0; i < keypoints.corners.size(); ++i) {
    const cv::KeyPoint& corner = keypoints.corners[i];
    const std::uint32_t image = 1, octave = static_cast<std::uint32_t>(corner.octave);
    const auto append = [&](const auto& value) {
      expected.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    append(image), append(corner.pt), append(octave), append(keypoints.descriptors[i]);
    expected.append(patches.ptr<char>(static_cast<int>(i)), kPatchSide * kPatchSide);
  }
  CHECK(bytes.substr(begin) == expected);
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
  check_fails("inspect config/vocabulary/README.md", "not a vocabulary");
  check_fails("", "subcommand is required");
}

}  // namespace
}  // namespace km
