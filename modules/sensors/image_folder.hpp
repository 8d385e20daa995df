#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/image_file.hpp"
#include "modules/sensors/sample_streams.hpp"

namespace km {

/// Files of the images of a frame.
struct StereoPairFile {
  Stamp stamp = 0;               ///< Stamp of the left image.
  std::filesystem::path left;    ///< File of the left image.
  std::filesystem::path right;   ///< File of the right image; empty with an RGB-D rig.
  int line = 0;                  ///< Row of the left image in the list.
  std::filesystem::path depth;   ///< Empty if there is none.
  std::filesystem::path labels;  ///< Empty if there is none.
};

/// The lists of a recording in a folder of images.
struct ImageFolder {
  std::filesystem::path name;  ///< The recording, for messages.
  std::filesystem::path list;  ///< The file that lists the frames, for messages.
  SensorRig rig;
  double depth_scale_m = 1e-3;         ///< Depth of one unit in depth images [m].
  std::vector<StereoPairFile> frames;  ///< Ascending.
  ReaderReport report;                 ///< Faults of the lists.
  LabelPalette palette;                ///< Empty for labels that are ids.
  ImuStream imu;                       ///< Samples of the whole recording, if the rig has them.
  std::filesystem::path imu_list;      ///< The file that lists them, for messages.
  std::vector<std::string> remarks;    ///< See DatasetReader::remarks().

  [[nodiscard]] bool is_rgbd() const { return rig.stereo.depth_source == DepthSource::kDepthImage; }
};

/// A stereo pair from disk, or the left image with an RGB-D rig, without depth and labels. Status
/// and problem are those of the first image that failed.
[[nodiscard]] LoadedImage<StereoFrame> load_stereo_pair(const StereoPairFile& files,
                                                        const StereoRig& rig);

/// Reads the frames of an ImageFolder. The first packet starts up to ImuStream::kLeadIn_s before
/// its frame, even if that is before the part. Unusable depth and label images are counted and
/// omitted.
class FolderReader final : public DatasetReader {
 public:
  /// Throws DatasetError for a part without a frame, and for an RGB-D recording without any depth
  /// image. Throws std::invalid_argument for a part that is empty or not a number.
  FolderReader(ImageFolder folder, const RecordingPart& part);

  /// The frames are those of the part.
  [[nodiscard]] const ImageFolder& folder() const { return folder_; }
  [[nodiscard]] const SensorRig& rig() const override { return folder_.rig; }
  using DatasetReader::next;
  [[nodiscard]] std::optional<SensorPacket> next(const ChooseUse& choose) override;
  [[nodiscard]] ReaderReport report() const override { return folder_.report; }
  [[nodiscard]] std::size_t pair_count() const override { return folder_.frames.size(); }
  [[nodiscard]] std::vector<std::string> remarks() const override { return folder_.remarks; }

 private:
  [[nodiscard]] bool has_imu(const StereoPairFile& files);
  [[nodiscard]] std::vector<ImuSample> imu_until(Stamp stamp);
  void load_depth(const std::filesystem::path& file, StereoFrame& frame);
  void load_labels(const std::filesystem::path& file, StereoFrame& frame);

  ImageFolder folder_;
  std::size_t next_ = 0;
};

}  // namespace km
