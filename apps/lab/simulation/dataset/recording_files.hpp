#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string_view>

#include "apps/lab/simulation/dataset/image_encoding.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Images that a robot's recording can have for one instant.
enum class ImageChannel { kLeft, kRight, kDepth, kLabels, kColor };

inline constexpr std::array<ImageChannel, 5> kImageChannels = {
    ImageChannel::kLeft, ImageChannel::kRight, ImageChannel::kDepth, ImageChannel::kLabels,
    ImageChannel::kColor};

/// Paths of the parts of one robot's recording: the EuRoC/ASL tree, with depth0, label0 and color0
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

/// A file of a recording that cannot be written. what() names the file and the reason.
struct RecordingError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Writes `bytes` under a temporary name beside `file` and renames it, so that an existing file is
/// complete, whenever the program is stopped. Missing folders are made. Throws RecordingError,
/// after which neither a new `file` nor the temporary one exists.
void write_whole_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_whole_file(const std::filesystem::path& file, std::string_view text);

/// True for a PNG or JPEG file that exists and has its end marker. After a crash of the machine, an
/// existing file may be incomplete.
[[nodiscard]] bool is_whole_image(const std::filesystem::path& file);

}  // namespace km
