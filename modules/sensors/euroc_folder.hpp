#pragma once

#include <filesystem>
#include <vector>

#include "modules/core/camera_calibration.hpp"
#include "modules/sensors/image_folder.hpp"
#include "modules/sensors/stream_stamps.hpp"

namespace km {

/// The part of a recording in a folder, and options for reading.
struct FolderOptions {
  RecordingPart part = {};
  CameraCalibration correction = {};  ///< Corrects stamps and cameras (EuRoC's layout).
  bool imu = true;      ///< False: packets have no samples, even if there is an inertial sensor.
  bool depth = false;   ///< Read depth images although there is a right camera.
  bool labels = false;  ///< Read label images.
};

/// Stereo pairs, ascending, and the difference of their stamps.
struct StereoPairFiles {
  std::vector<StereoPairFile> pairs;
  Synchrony synchrony;
};

/// The folder of a EuRoC recording that holds cam0: `folder`/mav0, or `folder` itself.
/// Throws DatasetError if there is neither.
[[nodiscard]] std::filesystem::path find_mav0(const std::filesystem::path& folder);

/// The stereo pairs of a EuRoC folder: rows `stamp [ns], file` of cam0/data.csv and cam1/data.csv,
/// matched by stamps (see find_synchrony()). Faulty rows and images without a partner are counted
/// in `report`. Throws DatasetError if a list is missing or contains no image.
[[nodiscard]] StereoPairFiles list_euroc_pairs(const std::filesystem::path& mav0,
                                               ReaderReport& report);

/// The left images of a EuRoC folder alone, for an RGB-D rig. Faults and errors are those of
/// list_euroc_pairs().
[[nodiscard]] std::vector<StereoPairFile> list_euroc_lefts(const std::filesystem::path& mav0,
                                                           ReaderReport& report);

/// Lists a EuRoC/ASL folder: mav0/{cam0,cam1,imu0} with data.csv, and images that the csv names, in
/// PNG or JPEG. Without SensorRig::has_imu it does not read imu0. An RGB-D rig has depth0 in place
/// of cam1: 16-bit images of one channel. Depth is listed if the rig has a depth range. Labels are
/// in label0, as 8-bit ids or as colours of label_palette.csv beside label0. If depth or labels
/// have a lower rate than images, some frames have none. The function reads only `labels` and the
/// time offset of `options`. Throws DatasetError for missing or unusable files, including requested
/// labels.
[[nodiscard]] ImageFolder list_euroc_folder(const std::filesystem::path& mav0, SensorRig rig,
                                            double depth_scale_m, const FolderOptions& options);

}  // namespace km
