#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/lie.hpp"
#include "modules/core/stamp.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/sensors/image_file.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {

/// A frame whose pose is given.
struct PosedFrame {
  std::shared_ptr<const StereoFrame> frame;  ///< With depth.
  SE3 T_world_cam = SE3::Identity();
};

/// The red kitchen of Microsoft's 7-Scenes, every fourth frame of a sequence at 30 Hz, without
/// inertial data. It has colour images, read as grey, depth [mm], assumed to be aligned with them,
/// and the poses of a tracker. The rig is one camera without distortion; the baseline is virtual,
/// see rgbd_rig(). Throws std::runtime_error or std::bad_optional_access if a file is not as
/// expected.
class RecordedKitchen {
 public:
  explicit RecordedKitchen(const std::filesystem::path& folder) : folder_(folder) {
    const std::string text = read_file(folder / "poses.txt");  // all frames: n r00 r01 r02 tx ...
    for (const TextRow& row : split_rows(text)) {
      const auto number = static_cast<int>(parse_int64(row.fields.at(0)).value());
      if (!std::filesystem::exists(file(number, ".color.jpg"))) continue;
      Eigen::Matrix<double, 3, 4, Eigen::RowMajor> T;
      for (std::size_t i = 0; i < 12; ++i) T.data()[i] = parse_double(row.fields.at(i + 1)).value();
      frames_.push_back({number, make_pose(nearest_rotation(T.leftCols<3>()), T.col(3))});
    }
  }

  [[nodiscard]] const StereoRig& rig() const { return rig_; }
  [[nodiscard]] std::size_t frame_count() const { return frames_.size(); }

  /// Skips `count` frames.
  void skip(std::size_t count) { next_frame_ = std::min(next_frame_ + count, frames_.size()); }

  /// The next frame in order of time, or nullopt at the end.
  [[nodiscard]] std::optional<PosedFrame> next() {
    if (next_frame_ == frames_.size()) return std::nullopt;
    const auto& [number, T_world_cam] = frames_[next_frame_++];
    const auto [width, height] = std::pair(rig_.cameras[0].width, rig_.cameras[0].height);
    ImageResult gray = load_gray_image(file(number, ".color.jpg"), width, height);
    DepthResult depth = load_depth_image(file(number, ".depth.png"), width, height, 1e-3, {});
    if (const std::string problem = gray.problem + depth.problem; !problem.empty())
      throw std::runtime_error(problem);
    StereoFrame frame{nanoseconds(number / 30.0), std::move(gray.image), {}};
    frame.depth = std::make_shared<const DepthImage>(std::move(depth.image));
    return PosedFrame{std::make_shared<const StereoFrame>(std::move(frame)), T_world_cam};
  }

 private:
  [[nodiscard]] std::filesystem::path file(int number, const char* ending) const {
    std::string digits = std::to_string(number);
    digits.insert(0, 6 - digits.size(), '0');
    return folder_ / ("frame-" + digits + ending);
  }

  std::filesystem::path folder_;
  StereoRig rig_ = rgbd_rig(
      {.width = 640, .height = 480, .fx = 585.0, .fy = 585.0, .cx = 320.0, .cy = 240.0}, 0.075);
  std::vector<std::pair<int, SE3>> frames_;
  std::size_t next_frame_ = 0;
};

}  // namespace km
