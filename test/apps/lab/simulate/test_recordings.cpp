#include <yaml-cpp/yaml.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>

#include "modules/sensors/node/open_folder.hpp"
#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

// kimera_multi_simulate as a program, on the smallest possible recordings.

namespace km {
namespace {

namespace fs = std::filesystem;

const std::string kProgram = std::string(KM_BIN_DIR) + "/kimera_multi_simulate";
const std::string kSmall =
    " --world vicon_room --robots 2 --duration 0.5 --resolution 64x48 --depth --depth-rate 10 "
    "--labels";
constexpr std::size_t kFrames = 10;  // for each robot

CommandResult simulate(const std::string& arguments, const fs::path& output) {
  return run_command(kProgram + arguments + " --output " + output.string());
}

// Every file below `folder` with its bytes.
std::map<std::string, std::string> contents(const TemporaryFolder& folder,
                                            const std::string& name) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path() / name))
    if (entry.is_regular_file()) {
      const std::string path = fs::relative(entry.path(), folder.path() / name).string();
      files[path] = folder.read(name + '/' + path);
    }
  return files;
}

std::size_t file_count(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

void check_equal(const std::map<std::string, std::string>& a,
                 const std::map<std::string, std::string>& b) {
  CHECK(a.size() == b.size());
  for (const auto& [path, bytes] : a) {
    CAPTURE(path);
    REQUIRE(b.contains(path));
    CHECK(b.at(path) == bytes);
  }
}

}  // namespace

TEST_CASE("The ordinary reader reads a recording, and missing images are made again",
          "[simulate]") {
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "r";
  const auto result = simulate(kSmall, output);
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  FolderReader reader = open_folder(output / "robot1");
  std::size_t frames = 0;
  std::size_t samples = 0;
  while (const auto packet = reader.next()) {
    ++frames;
    samples += packet->imu.size();
    CHECK(packet->frame->left.width == 64);
  }
  CHECK(frames == kFrames);
  CHECK(samples > 200 + 95);  // 1 s before the first image, 0.475 s with images, 200 Hz
  CHECK(reader.report().empty());
  const fs::path mav0 = output / "robot1/mav0";
  CHECK(file_count(mav0 / "depth0/data") == kFrames / 2);
  CHECK(file_count(mav0 / "label0/data") == kFrames);
  for (const char* file : {"world.ply", "objects.json", "label_palette.csv"})
    CHECK(fs::exists(output / file));
  CHECK_THAT(folder.read("r/team.yaml"),
             Catch::Contains("mapping.mode=semantic, --set, semantic_mapping.voxel_size_m=0.05, "
                             "--set, vio.drift_rotation=2e-4") &&
                 Catch::Contains("truth: \"robot1/mav0/state_groundtruth_estimate0/data.csv\""));

  const auto whole = contents(folder, "r");
  CHECK_THAT(simulate(kSmall, output).output, Catch::Contains("complete already; nothing to do"));
  // As a run leaves it that was stopped.
  std::string record = folder.read("r/simulation.json");
  CHECK_THAT(record, Catch::Contains("\"complete\": true"));  // as config/docker/entrypoint looks
  record.replace(record.rfind("true"), 4, "false");
  folder.write("r/simulation.json", record);
  fs::remove_all(output / "robot1/mav0/cam1/data");
  fs::resize_file(output / "robot0/mav0/cam0/data/1001000000000.jpg", 100);
  fs::remove(output / "team.yaml");
  CHECK(simulate(kSmall, output).exit_code == 0);
  check_equal(contents(folder, "r"), whole);
}

TEST_CASE("At the hardest level the reader reads the recording, with any number of threads",
          "[simulate]") {
  const TemporaryFolder folder;
  const std::string hard =
      kSmall + " --difficulty 3 --set timing.dropped_share=0.4 traffic.people=3 ";
  REQUIRE(simulate(hard + "--threads 3", folder.path() / "a").exit_code == 0);
  REQUIRE(simulate(hard + "--threads 1", folder.path() / "b").exit_code == 0);
  check_equal(contents(folder, "a"), contents(folder, "b"));
  const fs::path robot = folder.path() / "a/robot1";
  FolderReader reader = open_folder(robot);
  std::size_t frames = 0;
  while (const auto packet = reader.next()) ++frames;
  CHECK(frames > 0);
  CHECK(frames < kFrames);
  CHECK(frames == file_count(robot / "mav0/cam0/data"));
  CHECK(reader.report().empty());
  // The level has a focal length that is wrong by 0.5 %.
  const double focal_px =
      YAML::Load(folder.read("a/robot1/mav0/cam0/sensor.yaml"))["intrinsics"][0].as<double>();
  CHECK(std::abs(focal_px / (458.654 * 64 / 752) - 1.0) == Approx(0.005).epsilon(1e-3));
}

}  // namespace km
