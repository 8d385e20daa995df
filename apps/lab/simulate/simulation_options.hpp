#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/lab/simulate/dataset_record.hpp"
#include "apps/lab/simulate/effects.hpp"
#include "modules/core/config.hpp"

namespace CLI {
class App;
}  // namespace CLI

namespace km {

enum class WorldKind { kCity, kCamp, kViconRoom };
enum class CameraKind { kStereo, kRgbd };
inline constexpr Choice<WorldKind> kWorlds[] = {
    {"city", WorldKind::kCity}, {"camp", WorldKind::kCamp}, {"vicon_room", WorldKind::kViconRoom}};
inline constexpr Choice<CameraKind> kCameras[] = {{"stereo", CameraKind::kStereo},
                                                  {"rgbd", CameraKind::kRgbd}};

/// True for "752x480": both sides from 16 to 8192.
[[nodiscard]] bool is_resolution(const std::string& text);

/// Options of kimera_multi_simulate, from its command line and its file of options.
struct SimulationOptions {
  WorldKind world = WorldKind::kCity;
  int robots = 3;
  std::uint64_t seed = 1;
  double duration_s = 60.0;
  CameraKind cameras = CameraKind::kStereo;
  std::string resolution = "752x480";
  double rate_hz = 20.0;
  bool depth = false;
  double depth_rate_hz = 0.0;
  bool labels = false;
  bool motion_blur = false;
  int difficulty = 0;
  std::vector<std::string> settings;
  std::vector<std::filesystem::path> truths;
  std::vector<std::filesystem::path> imus;
  std::vector<std::string> names;
  std::filesystem::path output;
  int threads = 0;

  int width = 752;   ///< [px], from `resolution`.
  int height = 480;  ///< [px]
  Effects effects;   ///< From the difficulty and the settings.

  [[nodiscard]] bool is_recorded() const { return !truths.empty(); }
  /// True if any effect makes the recordings harder than at level 0.
  [[nodiscard]] bool is_disturbed() const { return difficulty > 0 || !settings.empty(); }

  void visit_fields(auto& visitor) {
    constexpr double kDay_s = 24.0 * 3600.0;
    visitor.required({"world", "output"});
    visitor.field("world", world, kWorlds, "World that the robots see");
    visitor.field("robots", robots, {1, 99}, "Number of robots that move through the world");
    visitor.field("seed", seed, {0U, 9'999'999'999'999'999'999U},
                  "Seed of all random numbers: the same seed gives the same bytes");
    visitor.field("duration", duration_s, {0.5, kDay_s}, "Duration of the recordings [s]");
    visitor.field("rig", cameras, kCameras, "Cameras of each robot");
    visitor.field("resolution", resolution, "Size of the images, WIDTHxHEIGHT [px]");
    visitor.field("rate", rate_hz, {0.1, 200.0}, "Images per second");
    visitor.field("depth", depth, "Also depth images of the left camera (16 bit, mm)");
    visitor.field("depth-rate", depth_rate_hz, {0.0, 200.0},
                  "Depth images per second, --rate divided by a whole number; 0: --rate");
    visitor.field("labels", labels, "Also class ids of the left camera's pixels");
    visitor.field("motion-blur", motion_blur, "Smear images along their motion");
    visitor.field(
        "difficulty", difficulty, {0, kHardestLevel},
        "Level of errors of sensors, clocks and calibration, and of clutter in the world");
    visitor.field("set", settings,
                  "Keys of single effects over those of the difficulty: section.key=value");
    visitor.field("trajectory", truths, Input{.must_exist = false},
                  "Recorded motion: true poses of flights, one file per robot: EuRoC's state CSV, "
                  "also gzipped; in the frame of the world");
    visitor.field("imu", imus, Input{.must_exist = false},
                  "The recorded inertial data, one CSV per --trajectory");
    visitor.field("names", names, "Names of the robots of recorded motion (default: the files')");
    visitor.field("output", output, "Folder of the recordings; a stopped run is continued");
    visitor.field("threads", threads, {0, 256},
                  "Number of threads that render; 0: one per processor");
    visitor.check(is_resolution(resolution), "resolution",
                  "is not WIDTHxHEIGHT with both from 16 to 8192");
  }
};

/// Adds the options to a command line, and --config for a file of them, a YAML map. The command
/// line has priority over the file. All errors of both are reported together, by name and line.
/// Derived values are filled in: names, the number of robots and the rate of depth images.
void define(CLI::App& app, SimulationOptions& options);

/// All parameters that the bytes of the recordings depend on; neither the threads nor the output
/// folder.
[[nodiscard]] ParameterList parameters(SimulationOptions options);

}  // namespace km
