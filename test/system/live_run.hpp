#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "test/support/command.hpp"

namespace km {

/// Rig file of topics with the names of EuRoC, with the calibration of `dataset`.
inline std::string euroc_rig(const std::filesystem::path& dataset) {
  return "left: {topic: /cam0/image_raw}\nright: {topic: /cam1/image_raw}\n"
         "imu: {topic: /imu0}\ncalibration: " +
         std::filesystem::absolute(dataset).string() + "\n";
}

/// Plays a recording on live topics of a ROS domain.
inline std::vector<std::string> driver_command(const std::filesystem::path& recording, int domain,
                                               const std::string& options) {
  return words_of(KM_BIN_DIR "/kimera_multi_publish " + recording.string() + " --domain " +
                  std::to_string(domain) + " --interface lo --wait 1 " + options);
}

/// Accepts the status lines of a robot that is beyond both: "5.6 s, 112 images, ...".
inline auto is_beyond(double least_s, int least_images = 0) {
  return [least_s, least_images](const std::string& line) {
    double seconds = 0.0;
    int images = 0;
    return std::sscanf(line.c_str(), "%lf s, %d images", &seconds, &images) == 2 &&
           seconds > least_s && images > least_images;
  };
}

}  // namespace km
