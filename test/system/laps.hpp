#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/core/stamp.hpp"
#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/system/team_run.hpp"

// Recordings of any length, made from a short piece that is repeated.

namespace km {

/// Rows of a CSV file without its header, with their stamps.
inline std::vector<std::pair<Stamp, std::string>> stamped_rows(const std::filesystem::path& csv) {
  std::vector<std::pair<Stamp, std::string>> rows;
  std::ifstream in(csv);
  for (std::string line; std::getline(in, line);) {
    const std::size_t comma = line.find(',');
    if (line.empty() || line[0] == '#' || comma == line.npos) continue;
    rows.emplace_back(std::stoll(line.substr(0, comma)), line.substr(comma));
  }
  return rows;
}

/// The rows of the first `piece` [ns], repeated.
inline void repeat(const std::vector<std::pair<Stamp, std::string>>& rows, Stamp piece, int times,
                   const std::filesystem::path& csv) {
  std::ofstream out(csv);
  out << "#stamp\n";
  for (int k = 0; k < times; ++k)
    for (const auto& [stamp, rest] : rows)
      if (stamp - rows.front().first < piece) out << stamp + k * piece << rest << '\n';
}

inline constexpr double kLap_s = 24.0;
inline constexpr double kFlight_s =
    2.0 * kLap_s;  ///< The second lap is up to 0.1 m beside the first.
inline constexpr Stamp kTakeOff = 1'400'000'000'000'000'000;

/// Pose of a body with EuRoC's axes (x up, z forward) in the Vicon room, periodic in kFlight_s.
inline SE3 pose_on_lap(int robot, double time_s) {
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

/// True poses of `seconds`, `rate` of them a second, as a TUM file.
inline void write_truth(int robot, double seconds, int rate, const std::filesystem::path& file) {
  std::ofstream out(file);
  const Stamp step = 1'000'000'000 / rate;
  for (int k = -rate / 2; k < static_cast<int>(rate * (seconds + 1.0)); ++k) {
    const SE3 T = pose_on_lap(robot, 1e-9 * static_cast<double>(k * step));
    const Eigen::Quaterniond q(T.linear());
    const Stamp stamp = kTakeOff + k * step;
    out << stamp / 1'000'000'000 << '.' << std::setw(9) << std::setfill('0')
        << stamp % 1'000'000'000 << std::setprecision(12);
    for (const double x : T.translation()) out << ' ' << x;
    out << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w() << '\n';
  }
}

/// Samples of EuRoC's inertial sensor, 200 Hz.
inline void write_inertial(int robot, double seconds, const std::filesystem::path& file) {
  constexpr Stamp kStep = 5'000'000;
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
    out << kTakeOff + k * kStep;
    for (const double w : gyro) out << ',' << w + gyro_noise(rng);
    for (const double a : accel) out << ',' << a + accel_noise(rng);
    out << '\n';
  }
}

/// Recordings of robots that fly laps for `seconds`, in world/robot0, world/robot1, ... of
/// `folder`.
inline void make_laps(int robots, double seconds, const TemporaryFolder& folder) {
  std::string truths, inertial, names;
  for (int robot = 0; robot < robots; ++robot) {
    const std::filesystem::path truth = folder.path() / ("truth" + std::to_string(robot) + ".tum"),
                                imu = folder.path() / ("imu" + std::to_string(robot) + ".csv");
    write_truth(robot, kFlight_s, 100, truth);
    write_inertial(robot, seconds, imu);
    truths += ' ' + truth.string();
    inertial += ' ' + imu.string();
    names += ' ' + robot_name(robot);
  }
  const std::filesystem::path world = folder.path() / "world";
  const CommandResult made =
      run_command(KM_BIN_DIR "/kimera_multi_simulate --world vicon_room --trajectory" + truths +
                  " --imu" + inertial + " --names" + names +
                  " --resolution 376x240 --rate 10 --end 48 --output " + world.string());
  CAPTURE(made.output);
  REQUIRE(made.exit_code == 0);
  const auto piece = static_cast<Stamp>(1e9 * kFlight_s);
  for (int robot = 0; robot < robots; ++robot) {
    const std::filesystem::path sensors = world / robot_name(robot) / "mav0";
    for (const char* camera : {"cam0", "cam1"}) {
      const std::filesystem::path csv = sensors / camera / "data.csv";
      repeat(stamped_rows(csv), piece, static_cast<int>(std::ceil(seconds / kFlight_s)), csv);
    }
    std::filesystem::copy_file(folder.path() / ("imu" + std::to_string(robot) + ".csv"),
                               sensors / "imu0" / "data.csv",
                               std::filesystem::copy_options::overwrite_existing);
  }
}

}  // namespace km
