#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "modules/core/stamp.hpp"
#include "test/support/shared_data.hpp"
#include "test/system/laps.hpp"
#include "test/system/team_run.hpp"

// Robots that stand still for long.

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kStanding = 3;
constexpr Stamp kPiece = 4'800'000'000;  // ns of EuRoC V1_01 before it takes off: 24 pairs at 5 Hz

// Images whose names are their stamps.
std::vector<std::pair<Stamp, std::string>> images_in(const fs::path& folder) {
  std::vector<std::pair<Stamp, std::string>> images;
  for (const auto& image : fs::directory_iterator(folder))
    images.emplace_back(std::stoll(image.path().stem().string()),
                        ',' + image.path().filename().string());
  std::sort(images.begin(), images.end());
  return images;
}

// The start of the recording, repeated for the wanted duration, in `folder`.
void make_standing(const fs::path& recording, double seconds, const fs::path& folder) {
  const int times = static_cast<int>(seconds / (1e-9 * static_cast<double>(kPiece))) + 1;
  for (const char* camera : {"cam0", "cam1"}) {
    const fs::path images = recording / "static_start" / camera, made = folder / "mav0" / camera;
    fs::create_directories(made);
    fs::create_directory_symlink(fs::absolute(images), made / "data");
    fs::copy_file(recording / "mav0" / camera / "sensor.yaml", made / "sensor.yaml");
    repeat(images_in(images), kPiece, times, made / "data.csv");
  }
  const fs::path imu = folder / "mav0" / "imu0";
  fs::create_directories(imu);
  fs::copy_file(recording / "mav0" / "imu0" / "sensor.yaml", imu / "sensor.yaml");
  repeat(stamped_rows(recording / "mav0" / "imu0" / "data.csv"), kPiece, times, imu / "data.csv");
}

// Null for the short form.
const char* long_soak() {
  return std::getenv("KM_SOAK_SECONDS");
}

double seconds_of_soak() {
  return long_soak() != nullptr ? std::atof(long_soak()) : 10.0;
}

// The short form plays as fast as it can. It does not measure growth: the slope of the second half,
// if it takes at least a minute.
TEST_CASE("Robots that stand still keep their place and take no more memory", "[system][soak]") {
  const auto recording = shared_data("euroc/V1_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  make_standing(*recording, seconds_of_soak(), folder.path());
  std::string team = "robots:\n";
  for (int k = 0; k < kStanding; ++k)
    team += "  - {id: " + std::to_string(k) + ", name: " + robot_name(k) + ", dataset: .}\n";
  const CommandResult run = run_command(
      KM_BIN_DIR "/kimera_multi_team --config " + folder.write("team.yaml", team).string() +
      " --output " + folder.path().string() + " --rate " + (long_soak() ? "1.0" : "max") +
      " --domain " + std::to_string(random_domain()) +
      " -- --set mapping.mode=metric --serve-limit 1000");
  CAPTURE(run.output);
  REQUIRE(run.exit_code == 0);
  for (int k = 0; k < kStanding; ++k) {
    CAPTURE(k);
    const RunSummary summary = read_summary(folder.path() / robot_name(k) / "summary.json");
    CHECK(static_cast<double>(summary.frames) > 5.0 * (seconds_of_soak() - 5.0));
    CHECK(summary.keyframes >= 1);
    CHECK(summary.keyframes <= 5);
    const double growth = summary.process.memory_growth_bytes_per_minute.value_or(0.0);
    std::cout << robot_name(k) << ": " << summary.keyframes << " keyframes, "
              << static_cast<double>(summary.process.memory_at_end_bytes) / 1e6
              << " MB at the end, " << growth / 1e6 << " MB a minute\n";
    CHECK(growth < 1e6);
  }
}

}  // namespace
}  // namespace km
