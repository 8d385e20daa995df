#pragma once

#include <filesystem>
#include <limits>
#include <optional>

#include "modules/evaluation/images/image_statistics.hpp"

namespace km {

/// Part of a recording [s since its first stereo pair].
struct RecordingWindow {
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();
};

/// `kimera_multi_evaluate images`: what its command line says.
struct ImagesCommand {
  std::filesystem::path dataset;  ///< EuRoC/ASL folder.
  std::filesystem::path compare;  ///< Another one, beside it; empty: none.
  RecordingWindow window;
  std::optional<double> compare_from_s;  ///< Window of the other; by default the same.
  std::optional<double> compare_to_s;
  std::optional<double> still_from_s;  ///< Where the camera also stands still, in recordings with
  std::optional<double> still_to_s;    ///< `window`; by default there is no such place.
  ImageStatisticsOptions options;
  std::filesystem::path json;  ///< Not written if empty.
};

/// Prints what the images of the recording are like, or both side by side, with progress on
/// standard error; writes the file asked for. Throws an exception whose message is one line.
void evaluate_images(const ImagesCommand& command);

}  // namespace km
