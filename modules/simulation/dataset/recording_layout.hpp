#pragma once

#include <array>
#include <filesystem>

#include "modules/core/stamp.hpp"
#include "modules/simulation/dataset/image_encoding.hpp"

namespace km {

/// What a robot's recording can hold of one instant.
enum class ImageChannel { kLeft, kRight, kDepth, kLabels, kColor };

inline constexpr std::array<ImageChannel, 5> kImageChannels = {
    ImageChannel::kLeft, ImageChannel::kRight, ImageChannel::kDepth, ImageChannel::kLabels,
    ImageChannel::kColor};

/// Where the parts of one robot's recording lie: the EuRoC/ASL tree, with depth0, label0 and color0
/// beside the cameras.
class RecordingLayout {
 public:
  /// `robot` is the folder that gets `mav0`; `format` is that of grey and colour images.
  RecordingLayout(const std::filesystem::path& robot, ImageFormat format)
      : mav0_(robot / "mav0"), format_(format) {}

  [[nodiscard]] const std::filesystem::path& mav0() const { return mav0_; }
  [[nodiscard]] std::filesystem::path folder(ImageChannel channel) const;
  [[nodiscard]] std::filesystem::path image(ImageChannel channel, Stamp stamp) const;
  [[nodiscard]] std::filesystem::path list(ImageChannel channel) const;
  [[nodiscard]] std::filesystem::path calibration(ImageChannel channel) const;
  [[nodiscard]] std::filesystem::path imu() const { return mav0_ / "imu0"; }
  [[nodiscard]] std::filesystem::path truth() const;

  /// ".jpg" or ".png"; depth and labels are always PNG.
  [[nodiscard]] std::string image_extension(ImageChannel channel) const;

 private:
  std::filesystem::path mav0_;
  ImageFormat format_;
};

}  // namespace km
