#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "test/support/command.hpp"
#include "test/support/euroc_copy.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kImages = 40;  // 2 s

// The first images of MH_01_easy, and the inertial samples from 5 s before them to 0.5 s after.
EurocCopy excerpt(const fs::path& recording) {
  EurocCopy copy(recording);
  for (auto& images : copy.cameras) images.resize(kImages);
  copy.samples.resize(1499);
  return copy;
}

constexpr std::size_t kImage = 24, kSample = 1199;  // items to corrupt, in the middle
constexpr Stamp kDay = 86'400'000'000'000;

CommandResult run_robot(const TemporaryFolder& folder) {
  return run_command(KM_BIN_DIR
                     "/kimera_multi_robot --config config/datasets/euroc.yaml --robot 0"
                     " --rate max --serve-limit 0 --interface lo --domain " +
                     std::to_string(random_domain()) + " --dataset " +
                     (folder.path() / "recording").string() + " --output " +
                     (folder.path() / "results").string());
}

struct Fault {
  std::string name;
  std::function<void(EurocCopy&)> corrupt;     // lists
  std::function<void(const fs::path&)> spoil;  // an image
  std::size_t poses;
  std::string message;  // with file and line
};

std::vector<Fault> faults() {
  const auto no_list = [](EurocCopy&) {};
  const auto no_image = [](const fs::path&) {};
  return {
      {"a 65535 x 65535 PNG header", no_list,
       [](const fs::path& image) {
         fs::remove(image);
         std::ofstream(image, std::ios::binary)
             << std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xff\xff\0\0\xff\xff\x08\0\0\0\0", 29)
             << "IEND";
       },
       kImages - 1, "1 images of the wrong size, first: "},
      {"a gyroscope at 1e300",
       [](EurocCopy& copy) {
         std::string& values = copy.samples[kSample].values;
         values.replace(0, values.find(','), "1e300");
       },
       no_image, kImages, "imu0/data.csv line 1201: 1e+300 rad/s (at most 100)"},
      {"an inertial stamp a day ahead",
       [](EurocCopy& copy) { copy.samples[kSample].stamp += kDay; }, no_image, kImages,
       "imu0/data.csv line 1201: "},
      {"an image's stamp a day ahead",
       [](EurocCopy& copy) {
         for (auto& images : copy.cameras) images[kImage].stamp += kDay;
       },
       no_image, kImages - 1, "2 stamps out of order, first: "},
      {"an image that is a link to itself", no_list,
       [](const fs::path& image) {
         fs::remove(image);
         fs::create_symlink(image.filename(), image);
       },
       kImages - 1, "no such image: Too many levels of symbolic links"},
  };
}

}  // namespace

TEST_CASE("A robot skips broken parts of its recording, reports them, and continues", "[system]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  for (const Fault& fault : faults()) {
    CAPTURE(fault.name);
    const TemporaryFolder folder;
    EurocCopy copy = excerpt(*recording);
    const EurocCopy::Image image = copy.cameras[0][kImage];
    const std::string name = std::to_string(image.stamp) + image.file.extension().string();
    fault.corrupt(copy);
    copy.write(folder.path() / "recording");
    fault.spoil(folder.path() / "recording/mav0/cam0/data" / name);
    const CommandResult result = run_robot(folder);
    CAPTURE(result.output);
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.output, Catch::Contains(fault.message));
    CHECK(line_count(folder.path() / "results/odometry.tum") == fault.poses);
  }
}

TEST_CASE("Inertial samples that end in the middle do not end the robot", "[system]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  EurocCopy copy = excerpt(*recording);
  copy.samples.erase(copy.samples.begin() + kSample, copy.samples.end() - 1);
  copy.samples.back().stamp += 5'000'000'000;
  copy.write(folder.path() / "recording");
  const CommandResult result = run_robot(folder);
  CAPTURE(result.output);
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.output, Catch::Contains("1 gaps between inertial samples"));
}

TEST_CASE("A file that is no recording ends --inspect as bad input with one line", "[system]") {
  const TemporaryFolder folder;
  const fs::path file = folder.write("a.bag", "#ROSBAG V1.2\n");
  const CommandResult result =
      run_command(KM_BIN_DIR "/kimera_multi_robot --inspect " + file.string());
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output,
             Catch::StartsWith("kimera_multi_robot: " + file.string() + " byte 0: "));
  CHECK(std::count(result.output.begin(), result.output.end(), '\n') == 1);
}

TEST_CASE("Mistakes on a robot's command line are reported by value and with a remedy",
          "[system]") {
  const TemporaryFolder folder;
  const std::string robot = KM_BIN_DIR "/kimera_multi_robot --dataset " + folder.path().string();
  const auto refusal = [&](const std::string& options) {
    const CommandResult result = run_command(robot + ' ' + options);
    CHECK(result.exit_code == 2);
    return result.output;
  };
  CHECK_THAT(refusal("--output x --robot 70000"),
             Catch::Contains("--robot: Value 70000 not in range") && Catch::Contains("65535"));
  const fs::path mistyped = folder.path() / "alcie";
  CHECK_THAT(
      refusal("--robot 1 --resume " + mistyped.string()),
      Catch::Contains(mistyped.string() + ": no such folder") && Catch::Contains("--output"));
  CHECK_FALSE(fs::exists(mistyped));
}

TEST_CASE("A folder that results cannot go to is refused before any other output", "[system]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  const std::string output = (folder.write("file", "") / "results").string();
  const CommandResult result =
      run_command(KM_BIN_DIR
                  "/kimera_multi_robot --config config/datasets/euroc.yaml --robot 0 "
                  "--interface lo --dataset " +
                  recording->string() + " --output " + output);
  CHECK(result.exit_code == 1);
  CHECK(result.output == "kimera_multi_robot: " + output +
                             ": cannot be written to: Not a directory; choose another folder for "
                             "the results\n");
}

TEST_CASE("Files that no run has written are not replaced by results", "[system]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  const fs::path map = folder.write("map.yaml", "mine");
  const CommandResult result =
      run_command(KM_BIN_DIR
                  "/kimera_multi_robot --config config/datasets/euroc.yaml --robot 0 "
                  "--interface lo --dataset " +
                  recording->string() + " --output " + folder.path().string());
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Catch::Contains(map.string() + ": would be replaced") &&
                                Catch::Contains("choose another folder"));
  CHECK(folder.read("map.yaml") == "mine");
}

TEST_CASE("Noise that no sensor has is refused before the run", "[system]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  excerpt(*recording).write(folder.path() / "recording");
  const std::string name = "recording/mav0/imu0/sensor.yaml", key = "gyroscope_noise_density:";
  std::string text = folder.read(name);
  text.insert(text.find(key) + key.size(), " 1e-300 #");
  fs::remove(folder.path() / name);  // a link to the original
  folder.write(name, text);
  const CommandResult result = run_robot(folder);
  CAPTURE(result.output);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Catch::Contains("imu0/sensor.yaml line") &&
                                Catch::Contains("gyroscope_noise_density is not a number within"));
}

}  // namespace km
