#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/frame_files.hpp"

namespace km {

/// Layouts of a recording in a folder of images.
enum class FolderLayout {
  kEuroc,        ///< EuRoC/ASL, see EurocReader.
  kKitti,        ///< KITTI odometry: image_0, image_1, calib.txt, times.txt.
  kTum,          ///< TUM RGB-D: rgb.txt and depth.txt, with the files that they list.
  kSevenScenes,  ///< Microsoft 7-Scenes: frame-NNNNNN.color and .depth, camera-intrinsics.txt.
};

/// For messages on a folder that has none of them.
inline constexpr const char* kKnownLayouts = "the layout of EuRoC, KITTI, TUM RGB-D or 7-Scenes";

/// The layout of `folder`, by the names of its files; kEuroc if it is none of the others.
[[nodiscard]] FolderLayout layout_of(const std::filesystem::path& folder);

/// Text such as "a folder in KITTI's layout".
[[nodiscard]] std::string to_string(FolderLayout layout);

/// A camera with aligned depth images.
struct DepthCamera {
  Camera camera;                ///< Its pose is not used.
  double depth_scale_m = 1e-3;  ///< Depth of one unit in the images [m].
  DepthRange range;
  double baseline_m = 0.1;  ///< Virtual baseline, see rgbd_rig().
};

/// A recording of cameras without an inertial sensor. The body is the left camera, to which the
/// true poses of these layouts refer.
struct ImageFolder {
  std::filesystem::path list;  ///< The file that lists the frames, for messages.
  SensorRig rig;
  double depth_scale_m = 1e-3;
  std::vector<StereoPairFile> frames;  ///< Ascending.
  ReaderReport report;                 ///< Faults of the list.
};

/// KITTI odometry. Row k of times.txt is the time [s] of image k in image_0 and image_1, whose name
/// has six digits (image_2 and image_3 without a folder image_0). Faulty rows count as rows,
/// blank lines do not. calib.txt has the projections of the rectified cameras: `P0: ` and 12
/// numbers, row by row. Throws DatasetError with file, line and value for a calibration or list
/// that cannot be used. Faulty rows of times.txt are counted, and images after the last row.
[[nodiscard]] ImageFolder read_kitti_folder(const std::filesystem::path& folder);

/// TUM RGB-D. Rows of rgb.txt and depth.txt are `time [s], file`. An image has the depth image that
/// is nearest in time, at most 0.02 s away. `camera`: as for tum_camera(). Errors as above.
[[nodiscard]] ImageFolder read_tum_folder(const std::filesystem::path& folder,
                                          const DepthCamera& camera);

/// The camera of a recording of the TUM RGB-D benchmark, by the freiburg1, freiburg2 or freiburg3
/// in the name of its folder. nullopt without such a name.
[[nodiscard]] std::optional<DepthCamera> tum_camera(const std::filesystem::path& folder);

/// Microsoft 7-Scenes. The time of frame N is N / 30 s; frames may be missing. Depth is in
/// millimetres. camera-intrinsics.txt is a 3x3 matrix. Errors as above.
[[nodiscard]] ImageFolder read_seven_scenes_folder(const std::filesystem::path& folder);

/// Reads the frames of an ImageFolder.
class ImageFolderReader final : public DatasetReader {
 public:
  /// Throws DatasetError for a part without a frame, and for an RGB-D recording without any depth
  /// image.
  ImageFolderReader(ImageFolder folder, const RecordingPart& part);

  [[nodiscard]] const SensorRig& rig() const override { return folder_.rig; }
  using DatasetReader::next;
  [[nodiscard]] std::optional<SensorPacket> next(const ChooseUse& choose) override;
  [[nodiscard]] ReaderReport report() const override { return folder_.report; }
  [[nodiscard]] std::size_t pair_count() const override { return folder_.frames.size(); }

 private:
  ImageFolder folder_;
  DepthAndLabelImages depth_;
  std::size_t next_ = 0;
};

}  // namespace km
