#pragma once

#include <filesystem>
#include <limits>
#include <optional>

#include "modules/evaluation/images/image_statistics.hpp"

namespace km {

/// `kimera_multi_evaluate images`: what its command line says.
struct ImagesCommand {
  std::filesystem::path dataset;  ///< EuRoC/ASL folder.
  std::filesystem::path compare;  ///< Another one, beside it; empty: none.
  double from_s = 0.0;            ///< Window, since the first stereo pair; of both.
  double to_s = std::numeric_limits<double>::infinity();
  std::optional<double> still_from_s;  ///< Where the camera stands still; by default the window.
  std::optional<double> still_to_s;
  ImageStatisticsOptions options;
  std::filesystem::path json;  ///< Not written if empty.
};

/// Prints what the images of the recording are like, or both side by side, with progress on
/// standard error; writes the file asked for. Throws an exception whose message is one line.
void evaluate_images(const ImagesCommand& command);

}  // namespace km
