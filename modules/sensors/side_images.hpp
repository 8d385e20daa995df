#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/sensors/reader_report.hpp"
#include "modules/sensors/stereo_pairs.hpp"

namespace km {

/// Depth and label images of a EuRoC folder: depth0, label0 and label_palette.csv. One that cannot
/// be used is counted and left out: its frame comes without. Const members are thread-safe.
class SideImages {
 public:
  /// Depth if `rig.depth` says so, labels if asked. Throws DatasetError for a depth_scale or a
  /// palette that cannot be read; ids need no palette.
  SideImages(const std::filesystem::path& mav0, const SensorRig& rig, bool labels);

  /// Finds the images of `frames`; see list_beside().
  void list(double tolerance_s, std::vector<StereoPairFile>& frames, ReaderReport& report) const;

  /// Reads those of one frame.
  void load(const StereoPairFile& files, StereoFrame& frame, ReaderReport& report) const;

  /// Empty without a file, or if no labels were asked for.
  [[nodiscard]] const LabelPalette& palette() const { return palette_; }

 private:
  void load_depth(const std::filesystem::path& file, StereoFrame& frame,
                  ReaderReport& report) const;
  void load_labels(const std::filesystem::path& file, StereoFrame& frame,
                   ReaderReport& report) const;

  std::filesystem::path mav0_;
  std::optional<DepthRange> depth_;
  bool labels_;
  double depth_scale_m_ = 0.0;
  LabelPalette palette_;
};

}  // namespace km
