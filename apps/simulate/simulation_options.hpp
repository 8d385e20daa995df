#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "modules/simulation/dataset/dataset_record.hpp"
#include "modules/simulation/dataset/image_encoding.hpp"

namespace km {

enum class WorldKind { kCity, kCamp, kViconRoom };
enum class CameraKind { kStereo, kRgbd };

/// What the command line of kimera_multi_simulate asks for.
struct SimulationOptions {
  WorldKind world = WorldKind::kCity;
  int robots = 3;
  std::uint64_t seed = 1;
  double duration_s = 60.0;  ///< Of the images.
  CameraKind cameras = CameraKind::kStereo;
  int width = 752;   ///< [px]
  int height = 480;  ///< [px]
  double rate_hz = 20.0;
  bool depth = false;  ///< Always on with CameraKind::kRgbd.
  double depth_rate_hz = 0.0;
  bool labels = false;
  bool color = false;
  ImageFormat format = ImageFormat::kJpeg;
  bool ideal_depth = false;
  bool motion_blur = false;
  std::filesystem::path output;
  int threads = 0;

  /// The recorded mode: one robot for each pair.
  std::vector<std::filesystem::path> truths;
  std::vector<std::filesystem::path> imus;
  std::vector<std::string> names;
  double start_s = 0.0;  ///< Since the first true pose.
  double end_s = 0.0;    ///< 0: to its end.

  [[nodiscard]] bool is_recorded() const { return !truths.empty(); }
};

/// Adds the options to a command line. Values out of bounds are refused while it is parsed.
void define(CLI::App& app, SimulationOptions& options);

/// What follows from what was given: names, the number of robots, the depth's rate. Throws
/// std::invalid_argument for options that contradict each other.
[[nodiscard]] SimulationOptions completed(SimulationOptions options);

/// Everything the bytes of the recordings depend on; neither threads nor the output's place.
[[nodiscard]] ParameterList parameters(const SimulationOptions& options);

/// The command that makes the same recordings, with DIR for the output.
[[nodiscard]] std::string command_line(const SimulationOptions& options);

[[nodiscard]] const char* name_of(WorldKind world);
[[nodiscard]] const char* name_of(CameraKind cameras);

}  // namespace km
