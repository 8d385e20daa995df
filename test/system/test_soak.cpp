#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/core/stamp.hpp"
#include "modules/core/text_rows.hpp"
#include "test/support/shared_data.hpp"
#include "test/system/team_run.hpp"

// Robots that stand still for long, or fly the same lap for long.

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

// Images whose names are their stamps.
std::vector<std::pair<Stamp, std::string>> images_in(const fs::path& folder) {
  std::vector<std::pair<Stamp, std::string>> images;
  for (const auto& image : fs::directory_iterator(folder))
    images.emplace_back(std::stoll(image.path().stem().string()),
                        ',' + image.path().filename().string());
  std::sort(images.begin(), images.end());
  return images;
}

// The rows of the first piece, repeated.
void repeat(const std::vector<std::pair<Stamp, std::string>>& rows, Stamp piece, int times,
            const fs::path& csv) {
  std::ofstream out(csv);
  out << "#stamp\n";
  for (int k = 0; k < times; ++k)
    for (const auto& [stamp, rest] : rows)
      if (stamp - rows.front().first < piece) out << stamp + k * piece << rest << '\n';
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
  return long_soak() != nullptr ? std::atof(long_soak()) : 20.0;
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

constexpr double kLap_s = 24.0;
constexpr double kFlight_s = 2.0 * kLap_s;  // the second lap is up to 0.1 m beside the first
constexpr Stamp kTakeOff = 1'400'000'000'000'000'000;

// Pose of a body with EuRoC's axes (x up, z forward) in the Vicon room, periodic in kFlight_s.
SE3 pose_on_lap(int robot, double time_s) {
  const double lap = 2.0 * std::numbers::pi * time_s / kLap_s, beside = 0.5 * lap, r = robot;
  const double yaw = lap + 0.5 * r + 0.5 * std::numbers::pi + 0.05 * std::sin(3.0 * beside + r);
  const double pitch = 0.05 * std::sin(3.0 * lap + r);
  const Eigen::Vector3d forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                                std::sin(pitch));
  const Eigen::Vector3d right(std::sin(yaw), -std::cos(yaw), 0.0);
  SE3 T = SE3::Identity();
  T.linear() << right.cross(forward), right, forward;
  T.translation() << 1.5 * std::cos(lap + 0.5 * r) + 0.05 * std::cos(3.0 * beside + r),
      0.4 + 1.8 * std::sin(lap + 0.5 * r) + 0.05 * std::sin(5.0 * beside + 2.0 * r),
      1.4 + 0.2 * std::sin(2.0 * lap + r) + 0.04 * std::sin(3.0 * beside + r);
  return T;
}

// True poses for the renderer.
void write_truth(int robot, const fs::path& file) {
  std::ofstream out(file);
  for (int k = -50; k < 100 * static_cast<int>(kFlight_s + 1.0); ++k) {
    const SE3 T = pose_on_lap(robot, 0.01 * k);
    const Eigen::Quaterniond q(T.linear());
    const Stamp stamp = kTakeOff + 10'000'000 * k;
    out << stamp / 1'000'000'000 << '.' << std::setw(9) << std::setfill('0')
        << stamp % 1'000'000'000 << std::setprecision(12);
    for (const double x : T.translation()) out << ' ' << x;
    out << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w() << '\n';
  }
}

// Samples of EuRoC's inertial sensor, 200 Hz.
void write_inertial(int robot, double seconds, const fs::path& file) {
  std::mt19937 rng(static_cast<unsigned>(robot));
  std::normal_distribution<double> gyro_noise(0.0, 2.4e-3), accel_noise(0.0, 2.8e-2);
  std::ofstream out(file);
  out << "#stamp,wx,wy,wz,ax,ay,az\n" << std::setprecision(12);
  for (int k = -200; k < static_cast<int>(200.0 * (seconds + 1.0)); ++k) {
    const double t = 0.005 * k, h = 1e-3;
    const SE3 before = pose_on_lap(robot, t - h), now = pose_on_lap(robot, t),
              after = pose_on_lap(robot, t + h);
    const Eigen::Vector3d gyro = so3_log(before.linear().transpose() * after.linear()) / (2.0 * h);
    const Eigen::Vector3d accel_world =
        (before.translation() - 2.0 * now.translation() + after.translation()) / (h * h);
    const Eigen::Vector3d accel =
        now.linear().transpose() * (accel_world + Eigen::Vector3d(0.0, 0.0, 9.81));
    out << kTakeOff + 5'000'000 * k;
    for (const double w : gyro) out << ',' << w + gyro_noise(rng);
    for (const double a : accel) out << ',' << a + accel_noise(rng);
    out << '\n';
  }
}

// Recordings of two robots that fly laps for `seconds`, in the folders a and b of `folder`.
void make_laps(double seconds, const TemporaryFolder& folder) {
  std::string truths, inertial;
  for (const int robot : {0, 1}) {
    const std::string number = std::to_string(robot);
    write_truth(robot, folder.path() / ("truth" + number + ".tum"));
    write_inertial(robot, seconds, folder.path() / ("imu" + number + ".csv"));
    truths += ' ' + (folder.path() / ("truth" + number + ".tum")).string();
    inertial += ' ' + (folder.path() / ("imu" + number + ".csv")).string();
  }
  const fs::path world = folder.path() / "world";
  const CommandResult made = run_command(
      KM_BIN_DIR "/kimera_multi_simulate --world vicon_room --trajectory" + truths + " --imu" +
      inertial + " --names a b --resolution 376x240 --rate 10 --end 48 --output " + world.string());
  CAPTURE(made.output);
  REQUIRE(made.exit_code == 0);
  const auto piece = static_cast<Stamp>(1e9 * kFlight_s);
  for (const int robot : {0, 1}) {
    const fs::path sensors = world / (robot == 0 ? "a" : "b") / "mav0";
    for (const char* camera : {"cam0", "cam1"}) {
      const fs::path csv = sensors / camera / "data.csv";
      repeat(stamped_rows(csv), piece, static_cast<int>(std::ceil(seconds / kFlight_s)), csv);
    }
    fs::copy_file(folder.path() / ("imu" + std::to_string(robot) + ".csv"),
                  sensors / "imu0" / "data.csv", fs::copy_options::overwrite_existing);
  }
}

// Bytes that the robot whose results are in `folder` has sent until `time_s`.
double sent_until(const fs::path& folder, double time_s) {
  std::ifstream in(folder / "traffic.csv");
  const std::string text(std::istreambuf_iterator<char>(in), {});
  std::map<std::pair<std::string, std::string>, double> newest;  // by topic and peer
  for (const TextRow& row : split_rows(text))
    if (row.fields.at(1) == "out" && number_in(row, 0).value_or(0.0) <= time_s)
      newest[{std::string(row.fields[2]), std::string(row.fields[4])}] =
          number_in(row, 6).value_or(0.0) + number_in(row, 7).value_or(0.0);
  double bytes = 0.0;
  for (const auto& [topic, sent] : newest) bytes += sent;
  return bytes;
}

TEST_CASE("A lap that is flown again costs a tenth of the bytes, and little memory",
          "[system][laps]") {
  const char* const wanted = std::getenv("KM_LAP_SECONDS");
  if (wanted == nullptr || !fs::exists(KM_BIN_DIR "/kimera_multi_simulate")) {
    std::cout << "SKIPPED: takes minutes and the simulator, see test/endure laps\n";
    return;
  }
  const double seconds = std::atof(wanted);
  const TemporaryFolder folder;
  make_laps(seconds, folder);
  const std::string team = folder
                               .write("team.yaml",
                                      "robots:\n  - {id: 0, name: robot0, dataset: world/a}\n"
                                      "  - {id: 1, name: robot1, dataset: world/b}\n")
                               .string();
  const CommandResult run =
      run_command(KM_BIN_DIR "/kimera_multi_team --config " + team + " --output " +
                  folder.path().string() + " --domain " + std::to_string(random_domain()));
  CAPTURE(run.output);
  REQUIRE(run.exit_code == 0);
  for (const int robot : {0, 1}) {
    const fs::path results = folder.path() / robot_name(robot);
    const RunSummary summary = read_summary(results / "summary.json");
    const double growth = summary.process.memory_growth_bytes_per_minute.value_or(0.0);
    const double first = sent_until(results, kLap_s);
    const double laps = std::floor(seconds / kLap_s) - 1.0;
    const double again = (sent_until(results, kLap_s * (laps + 1.0)) - first) / laps;
    std::cout << robot_name(robot) << ": " << 1e-3 * first << " kB in the first lap, "
              << 1e-3 * again << " kB in a later one, " << growth / 1e6 << " MB a minute\n";
    CHECK(growth < 1e6);
    CHECK(again < 0.1 * first);
  }
}

}  // namespace
}  // namespace km
