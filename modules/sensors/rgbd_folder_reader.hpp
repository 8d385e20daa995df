#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/geometry.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/reader_report.hpp"

namespace km {

/// A frame whose pose is given.
struct PosedFrame {
  std::shared_ptr<const StereoFrame> frame;
  SE3 T_world_cam = SE3::Identity();
};

/// What an RGB-D folder does not say.
struct RgbdFolderOptions {
  double rate_hz = 30.0;      ///< Of the frame numbers: stamp = number / rate.
  DepthRange range = {};      ///< Other depths are none.
  double baseline_m = 0.075;  ///< Virtual (see rgbd_rig()): Kinect's projector to camera, about.
};

/// Reads a folder of RGB-D frames with given poses and no inertial data, as of Microsoft's
/// 7-Scenes: frame-NNNNNN.color.(png|jpg), read as grey; frame-NNNNNN.depth.png, 16 bits [mm], 0
/// and 65535 for none, taken as aligned with the colour; camera-intrinsics.txt, a 3x3 matrix [px]
/// without distortion; and camera-to-world poses, frame-NNNNNN.pose.txt (4x4) or one poses.txt with
/// rows `number r00 r01 r02 tx r10 ... tz`. Not thread-safe.
class RgbdFolderReader {
 public:
  /// Reads the lists and the first image's size. Throws DatasetError, naming the file, without
  /// folder, frames, or intrinsics that make sense, and std::invalid_argument for bad options.
  explicit RgbdFolderReader(const std::filesystem::path& folder,
                            const RgbdFolderOptions& options = {});

  /// The rig: one camera, body and camera are one.
  [[nodiscard]] const StereoRig& rig() const { return rig_; }

  /// The next frame, in order of their numbers, or nullopt at the end. Frames without a usable pose
  /// or colour image are skipped, those without depth have none; both are counted.
  [[nodiscard]] std::optional<PosedFrame> next();

  /// Faults met so far.
  [[nodiscard]] const ReaderReport& report() const { return report_; }

  /// Frames that next() can give at most.
  [[nodiscard]] std::size_t frame_count() const { return frames_.size(); }

 private:
  struct FrameFile {
    int number = 0;
    std::filesystem::path color;
  };

  void list_frames();
  void read_intrinsics();
  void read_poses();
  [[nodiscard]] std::filesystem::path beside(const FrameFile& file, const char* ending) const;
  [[nodiscard]] std::optional<SE3> pose_of(const FrameFile& file);
  [[nodiscard]] std::optional<SE3> pose_file(const std::filesystem::path& file);

  std::filesystem::path folder_;
  RgbdFolderOptions options_;
  ReaderReport report_;
  StereoRig rig_;
  std::vector<FrameFile> frames_;  // ascending numbers
  std::map<int, SE3> poses_;       // of poses.txt
  std::size_t next_frame_ = 0;
};

}  // namespace km
