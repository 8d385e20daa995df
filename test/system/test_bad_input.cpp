#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kImages = 40;  // 2 s

std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream stream(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

void write_lines(const fs::path& file, const std::vector<std::string>& lines) {
  std::ofstream stream(file, std::ios::binary);
  for (const std::string& line : lines) stream << line << '\n';
}

// The first images of MH_01_easy, linked, with the inertial samples around them.
class Excerpt {
 public:
  explicit Excerpt(const fs::path& recording) {
    for (const std::string camera : {"cam0", "cam1"}) {
      const fs::path from = recording / "mav0" / camera, to = mav0() / camera;
      fs::create_directories(to / "data");
      std::vector<std::string> list = lines_of(from / "data.csv");
      list.resize(kImages + 1);
      write_lines(to / "data.csv", list);
      for (std::size_t i = 1; i < list.size(); ++i) {
        const std::string name = list[i].substr(list[i].find(',') + 1);
        fs::create_symlink(from / "data" / name, to / "data" / name);
      }
      fs::copy_file(from / "sensor.yaml", to / "sensor.yaml");
    }
    fs::create_directories(mav0() / "imu0");
    std::vector<std::string> samples = lines_of(recording / "mav0/imu0/data.csv");
    samples.resize(1500);  // from 5 s before the first image to 0.5 s after the last
    write_lines(mav0() / "imu0/data.csv", samples);
    fs::copy_file(recording / "mav0/imu0/sensor.yaml", mav0() / "imu0/sensor.yaml");
  }

  fs::path root() const { return folder_.path(); }
  fs::path mav0() const { return folder_.path() / "mav0"; }

  // Changes row `row` of a list; the header is row 0.
  void corrupt(const std::string& file, std::size_t row,
               const std::function<std::string(const std::string&)>& change) const {
    std::vector<std::string> lines = lines_of(mav0() / file);
    lines.at(row) = change(lines.at(row));
    write_lines(mav0() / file, lines);
  }
  fs::path image(std::size_t row) const {
    const std::string line = lines_of(mav0() / "cam0/data.csv").at(row);
    return mav0() / "cam0/data" / line.substr(line.find(',') + 1);
  }

 private:
  TemporaryFolder folder_;
};

std::string in_fields(const std::string& line, std::size_t field, const std::string& value) {
  std::istringstream fields(line);
  std::string result;
  std::size_t number = 0;
  for (std::string text; std::getline(fields, text, ','); ++number)
    result += (number > 0 ? "," : "") + (number == field ? value : text);
  return result;
}

std::string day_ahead(const std::string& line) {
  const std::size_t comma = line.find(',');
  return std::to_string(std::stoll(line.substr(0, comma)) + 86'400'000'000'000) +
         line.substr(comma);
}

CommandResult run_robot(const fs::path& dataset, const fs::path& output) {
  return run_command(KM_BIN_DIR
                     "/kimera_multi_robot --config config/datasets/euroc.yaml --robot 0"
                     " --rate max --serve-limit 0 --interface lo --domain " +
                     std::to_string(random_domain()) + " --dataset " + dataset.string() +
                     " --output " + output.string());
}

struct Fault {
  std::string name;
  std::function<void(const Excerpt&)> corrupt;
  std::size_t poses;
  std::string message;  // with file and line
};

std::vector<Fault> faults() {
  return {
      {"a 65535 x 65535 PNG header",
       [](const Excerpt& excerpt) {
         const fs::path image = excerpt.image(25);
         fs::remove(image);
         std::ofstream(image, std::ios::binary)
             << std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xff\xff\0\0\xff\xff\x08\0\0\0\0", 29)
             << "IEND";
       },
       kImages - 1, "1 images of the wrong size, first: "},
      {"a gyroscope at 1e300",
       [](const Excerpt& excerpt) {
         excerpt.corrupt("imu0/data.csv", 1200,
                         [](const std::string& line) { return in_fields(line, 1, "1e300"); });
       },
       kImages, "imu0/data.csv line 1201: 1e+300 rad/s (at most 100)"},
      {"an inertial stamp a day ahead",
       [](const Excerpt& excerpt) { excerpt.corrupt("imu0/data.csv", 1200, day_ahead); }, kImages,
       "imu0/data.csv line 1201: "},
      {"an image's stamp a day ahead",
       [](const Excerpt& excerpt) {
         excerpt.corrupt("cam0/data.csv", 25, day_ahead);
         excerpt.corrupt("cam1/data.csv", 25, day_ahead);
       },
       kImages - 1, "2 stamps out of order, first: "},
      {"an image that is a link to itself",
       [](const Excerpt& excerpt) {
         const fs::path image = excerpt.image(25);
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
    const Excerpt excerpt(fs::absolute(*recording));
    fault.corrupt(excerpt);
    const CommandResult result = run_robot(excerpt.root(), excerpt.root() / "results");
    CAPTURE(result.output);
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.output, Catch::Contains(fault.message));
    CHECK(lines_of(excerpt.root() / "results/odometry.tum").size() == fault.poses);
  }
}

TEST_CASE("Inertial samples that end in the middle do not end the robot", "[system]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const Excerpt excerpt(fs::absolute(*recording));
  std::vector<std::string> samples = lines_of(excerpt.mav0() / "imu0/data.csv");
  const std::string last = samples.back();
  samples.resize(1200);
  const std::int64_t late = std::stoll(last) + 5'000'000'000;
  samples.push_back(std::to_string(late) + last.substr(last.find(',')));
  write_lines(excerpt.mav0() / "imu0/data.csv", samples);
  const CommandResult result = run_robot(excerpt.root(), excerpt.root() / "results");
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
      Catch::Contains(mistyped.string() + ": there is no such folder, so no run to continue") &&
          Catch::Contains("--output"));
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

TEST_CASE("Noise that no sensor has is refused before the run", "[system]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const Excerpt excerpt(fs::absolute(*recording));
  std::vector<std::string> lines = lines_of(excerpt.mav0() / "imu0/sensor.yaml");
  for (std::string& line : lines)
    if (line.starts_with("gyroscope_noise_density:")) line = "gyroscope_noise_density: 1e-300";
  write_lines(excerpt.mav0() / "imu0/sensor.yaml", lines);
  const CommandResult result = run_robot(excerpt.root(), excerpt.root() / "results");
  CAPTURE(result.output);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Catch::Contains("imu0/sensor.yaml line") &&
                                Catch::Contains("gyroscope_noise_density is not a number within"));
}

}  // namespace km
