#pragma once

#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "modules/sensors/text_file.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {

/// Frames of the red kitchen of Microsoft's 7-Scenes, a sequence at 30 Hz without inertial data,
/// with the camera's poses by a tracker. Depth is assumed to be aligned with the images, which have
/// no intrinsics of their own.
class RecordedKitchen {
 public:
  /// Frames whose numbers are multiples of `every`, of every fourth in `folder`.
  RecordedKitchen(const fs::path& folder, int every)
      : poses_(select(fs::absolute(folder), every)) {}

  [[nodiscard]] const StereoRig& rig() const { return reader_.rig().stereo; }
  [[nodiscard]] std::size_t frame_count() const { return poses_.size(); }
  [[nodiscard]] const SE3& T_world_cam(const StereoFrame& frame) const {
    return poses_.at(frame.stamp);
  }
  /// The next frame in order of time, or null at the end.
  [[nodiscard]] std::shared_ptr<const StereoFrame> next() {
    const auto packet = reader_.next();
    return packet ? packet->frame : nullptr;
  }

 private:
  std::map<Stamp, SE3> select(const fs::path& folder, int every) {
    std::map<Stamp, SE3> poses;
    const std::string text = read_file(folder / "poses.txt");  // all frames: n r00 r01 r02 tx ...
    for (const TextRow& row : split_rows(text)) {
      std::string digits(row.fields.at(0));
      const int number = std::stoi(digits);
      digits.insert(0, 6 - digits.size(), '0');
      if (number % every != 0 || !fs::exists(folder / ("frame-" + digits + ".color.jpg"))) continue;
      for (const char* const ending : {".color.jpg", ".depth.png"})
        link(folder, "frame-" + digits + ending);
      Eigen::Matrix<double, 3, 4, Eigen::RowMajor> T;
      for (std::size_t i = 0; i < 12; ++i) T.data()[i] = parse_double(row.fields.at(i + 1)).value();
      poses[nanoseconds(number / 30.0)] = make_pose(nearest_rotation(T.leftCols<3>()), T.col(3));
    }
    link(folder, "camera-intrinsics.txt");
    return poses;
  }
  void link(const fs::path& folder, const std::string& name) const {
    fs::create_symlink(folder / name, links_.path() / name);
  }

  TemporaryFolder links_;
  std::map<Stamp, SE3> poses_;
  FolderReader reader_ = open_folder(links_.path());
};

}  // namespace km
