#include "apps/simulate/missing_files.hpp"

#include <charconv>
#include <fstream>
#include <string>
#include <vector>

#include "modules/simulation/dataset/recording_layout.hpp"
#include "modules/simulation/dataset/whole_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

std::vector<ImageChannel> channels_of(const SimulationOptions& options) {
  std::vector<ImageChannel> channels = {ImageChannel::kLeft};
  if (options.cameras == CameraKind::kStereo) channels.push_back(ImageChannel::kRight);
  if (options.depth) channels.push_back(ImageChannel::kDepth);
  if (options.labels) channels.push_back(ImageChannel::kLabels);
  if (options.color) channels.push_back(ImageChannel::kColor);
  return channels;
}

std::size_t missing_of(const std::vector<fs::path>& files) {
  std::size_t missing = 0;
  for (const fs::path& file : files) missing += fs::exists(file) ? 0U : 1U;
  return missing;
}

std::size_t missing_images(const RecordingLayout& layout, ImageChannel channel) {
  std::ifstream list(layout.list(channel));
  if (!list) return 1;
  std::size_t missing = 0;
  for (std::string line; std::getline(list, line);) {
    Stamp stamp = 0;
    const bool is_row =
        std::from_chars(line.data(), line.data() + line.size(), stamp).ec == std::errc();
    if (is_row && !is_whole_image(layout.image(channel, stamp))) ++missing;
  }
  return missing;
}

}  // namespace

std::size_t missing_files(const SimulationOptions& options) {
  const fs::path& folder = options.output;
  std::size_t missing = missing_of({folder / "README.md", folder / "team.yaml",
                                    folder / "label_palette.csv", folder / "world.ply"});
  for (const std::string& name : options.names) {
    const RecordingLayout layout(folder / name, options.format);
    missing += missing_of({layout.mav0() / "label_palette.csv", layout.imu() / "data.csv",
                           layout.imu() / "sensor.yaml", layout.truth()});
    for (const ImageChannel channel : channels_of(options)) {
      missing += missing_images(layout, channel);
      if (channel != ImageChannel::kLabels) missing += missing_of({layout.calibration(channel)});
    }
  }
  return missing;
}

}  // namespace km
