#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "modules/core/camera_calibration.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/frame_files.hpp"
#include "modules/sensors/imu_stream.hpp"

namespace km {

/// Calibration that a recording contains.
struct EurocCalibration {
  SensorRig rig;
  double depth_scale_m = 1e-3;  ///< Depth of one unit in depth images [m].
};

/// Part of a recording, in seconds since the first frame of the whole recording, and options for
/// reading.
struct EurocOptions {
  double from_s = 0.0;                                    ///< First instant of the part.
  double to_s = std::numeric_limits<double>::infinity();  ///< First instant after the part.
  std::optional<Stamp> not_before = {};                   ///< No frame before this instant.
  /// EurocReader corrects the stamps, open_euroc() the cameras.
  CameraCalibration correction = {};
  bool imu = true;      ///< False: packets have no samples, even if there is an inertial sensor.
  bool depth = false;   ///< Read depth images although there is a right camera (open_euroc()).
  bool labels = false;  ///< Read label images.
};

/// The folder of a EuRoC recording that holds cam0: `folder`/mav0, or `folder` itself.
/// Throws DatasetError if there is neither.
[[nodiscard]] std::filesystem::path find_mav0(const std::filesystem::path& folder);

/// Reads a EuRoC/ASL folder: mav0/{cam0,cam1,imu0} with data.csv, and images that the csv names, in
/// PNG or JPEG. Without SensorRig::has_imu it does not read imu0. An RGB-D rig has
/// depth0 in place of cam1: 16-bit images of one channel. Labels are in label0, as 8-bit ids or as
/// colours of label_palette.csv beside label0. If depth or labels have a lower rate than images,
/// some frames have none.
///
/// The first packet starts up to ImuStream::kLeadIn_s before its frame, even if that is before
/// `from_s`.
class EurocReader final : public DatasetReader {
 public:
  /// `folder` as for find_mav0(). Reads the lists, but no image yet. Depth images are read if the
  /// rig has a depth range. Throws DatasetError for missing or unusable files, including requested
  /// labels, for an RGB-D recording without any depth image, and for a window without a frame.
  /// Throws std::invalid_argument for a window that is empty or not a number.
  EurocReader(const std::filesystem::path& folder, EurocCalibration calibration,
              const EurocOptions& options = {});

  [[nodiscard]] const SensorRig& rig() const override { return rig_; }
  using DatasetReader::next;
  [[nodiscard]] std::optional<SensorPacket> next(const ChooseUse& choose) override;
  [[nodiscard]] ReaderReport report() const override { return report_; }
  [[nodiscard]] std::size_t pair_count() const override { return files_.pairs.size(); }

  [[nodiscard]] std::vector<std::string> remarks() const override;

  /// Palette of the labels; empty if none are read, or for ids without a palette.
  [[nodiscard]] const LabelPalette& label_palette() const { return side_images_.palette(); }

  /// First and last frame of the window.
  [[nodiscard]] Stamp first_stamp() const { return files_.pairs.front().stamp; }
  [[nodiscard]] Stamp last_stamp() const { return files_.pairs.back().stamp; }

 private:
  [[nodiscard]] bool has_imu(const StereoPairFile& pair);
  [[nodiscard]] std::vector<ImuSample> imu_until(Stamp stamp);

  std::filesystem::path mav0_;
  ReaderReport report_;
  SensorRig rig_;
  DepthAndLabelImages side_images_;
  StereoPairFiles files_;  // files of the window
  const bool reads_imu_;
  ImuStream imu_;  // samples of the whole recording
  std::size_t next_pair_ = 0;
};

}  // namespace km
