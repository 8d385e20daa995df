#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/camera_calibration.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/image_file.hpp"
#include "modules/sensors/sample_streams.hpp"
#include "modules/sensors/stream_stamps.hpp"

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

/// Layouts of a recording in a folder of images.
enum class FolderLayout {
  kEuroc,        ///< EuRoC/ASL, see list_euroc_folder().
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

/// Usual range of a depth camera with structured light.
inline constexpr double kStructuredLightRange_m = 8.0;

/// A camera with aligned depth images.
struct DepthCamera {
  Camera camera;                ///< Its pose is not used.
  double depth_scale_m = 1e-3;  ///< Depth of one unit in the images [m].
  DepthRange range;
  double baseline_m = 0.1;  ///< Virtual baseline, see rgbd_rig().
};

/// The layouts below have no inertial sensor. The body is the left camera, to which their true
/// poses refer.
///
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
