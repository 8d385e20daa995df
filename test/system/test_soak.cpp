#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "modules/core/stamp.hpp"
#include "test/support/shared_data.hpp"
#include "test/system/team_run.hpp"

// Robots that stand still.

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kStanding = 3;
constexpr Stamp kPiece = 4'800'000'000;  // ns of EuRoC V1_01 before it takes off: 24 pairs at 5 Hz

// Rows of a CSV file without its header, with their stamps.
std::vector<std::pair<Stamp, std::string>> stamped_rows(const fs::path& csv) {
  std::vector<std::pair<Stamp, std::string>> rows;
  std::ifstream in(csv);
  for (std::string line; std::getline(in, line);) {
    const std::size_t comma = line.find(',');
    if (line.empty() || line[0] == '#' || comma == line.npos) continue;
    rows.emplace_back(std::stoll(line.substr(0, comma)), line.substr(comma));
  }
  return rows;
}

// The rows of the first `piece` [ns], repeated.
void repeat(const std::vector<std::pair<Stamp, std::string>>& rows, Stamp piece, int times,
            const fs::path& csv) {
  std::ofstream out(csv);
  out << "#stamp\n";
  for (int k = 0; k < times; ++k)
    for (const auto& [stamp, rest] : rows)
      if (stamp - rows.front().first < piece) out << stamp + k * piece << rest << '\n';
}

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

TEST_CASE("Robots that stand still keep their place", "[system]") {
  const auto recording = shared_data("euroc/V1_01_easy");
  if (!recording) return;
  constexpr double kSeconds = 10.0;
  const TemporaryFolder folder;
  make_standing(*recording, kSeconds, folder.path());
  std::string robots = "robots:\n";
  for (int k = 0; k < kStanding; ++k)
    robots += "  - {id: " + std::to_string(k) + ", name: " + robot_name(k) + ", dataset: .}\n";
  const TeamRun run = run_team(folder.write("team.yaml", robots), folder.path(), folder, {},
                               "--set mapping.mode=metric");
  CAPTURE(run.result.output);
  REQUIRE(run.result.exit_code == 0);
  for (int k = 0; k < kStanding; ++k) {
    CAPTURE(k);
    const RunSummary summary = read_summary(folder.path() / robot_name(k) / "summary.json");
    CHECK(static_cast<double>(summary.frames) > 5.0 * (kSeconds - 5.0));
    CHECK(summary.keyframes >= 1);
    CHECK(summary.keyframes <= 5);
  }
}

}  // namespace
}  // namespace km
