#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Encoded images of width * height pixels. The same input gives the same bytes.

/// JPEG at quality 92, as the recorded images used here. It correlates the noise of neighbouring
/// pixels, which affects features and optical flow.
[[nodiscard]] std::vector<std::uint8_t> encode_gray(const GrayImage& image);

/// 16-bit PNG of millimetres, 0: no depth.
[[nodiscard]] std::vector<std::uint8_t> encode_depth(int width, int height,
                                                     const std::vector<std::uint16_t>& depth_mm);

/// 8-bit PNG of class ids.
[[nodiscard]] std::vector<std::uint8_t> encode_labels(int width, int height,
                                                      const std::vector<LabelId>& labels);

/// Images that a robot's recording can have for one instant.
enum class ImageChannel { kLeft, kRight, kDepth, kLabels };

inline constexpr std::array<ImageChannel, 4> kImageChannels = {
    ImageChannel::kLeft, ImageChannel::kRight, ImageChannel::kDepth, ImageChannel::kLabels};

/// Paths of the parts of one robot's recording: the EuRoC/ASL tree, with depth0 and label0
/// beside the cameras.
class RecordingLayout {
 public:
  /// `robot` is the folder that gets `mav0`.
  explicit RecordingLayout(const std::filesystem::path& robot) : mav0_(robot / "mav0") {}

  [[nodiscard]] const std::filesystem::path& mav0() const { return mav0_; }
  [[nodiscard]] std::filesystem::path image(ImageChannel channel, Stamp stamp) const;
  [[nodiscard]] std::filesystem::path list(ImageChannel channel) const;
  [[nodiscard]] std::filesystem::path calibration(ImageChannel channel) const;
  [[nodiscard]] std::filesystem::path imu() const { return mav0_ / "imu0"; }
  [[nodiscard]] std::filesystem::path truth() const;

  /// ".jpg" for grey images, ".png" for depth and labels.
  [[nodiscard]] static const char* image_extension(ImageChannel channel);

 private:
  [[nodiscard]] std::filesystem::path folder(ImageChannel channel) const;

  std::filesystem::path mav0_;
};

/// As write_file(); missing folders are made.
void write_whole_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

/// True for a PNG or JPEG file that exists and has its end marker. After a crash of the machine, an
/// existing file may be incomplete.
[[nodiscard]] bool is_whole_image(const std::filesystem::path& file);

/// True state of a robot at one instant: a row of state_groundtruth_estimate0.
struct TrueState {
  Stamp stamp = 0;
  SE3 T_world_body = SE3::Identity();
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();       ///< [rad/s]
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();      ///< [m/s^2]
};

/// Texts of data.csv in EuRoC's columns; numbers read back as the same doubles.
[[nodiscard]] std::string imu_csv(const std::vector<ImuSample>& samples);
[[nodiscard]] std::string state_csv(const std::vector<TrueState>& states);

/// Rows `stamp, stamp.extension`.
[[nodiscard]] std::string image_csv(const std::vector<Stamp>& stamps, const std::string& extension);

/// Texts of sensor.yaml of a pinhole camera with radial-tangential distortion in the EuRoC/ASL
/// format. Numbers have enough digits to restore the doubles, so a reader gets exactly the
/// calibration used for rendering.
[[nodiscard]] std::string camera_yaml(const Camera& camera, double rate_hz,
                                      const std::string& comment);

/// Properties of a depth camera that the camera in its place does not have.
struct DepthCameraFigures {
  double rate_hz = 20.0;
  double min_range_m = 0.0;
  double max_range_m = 65.0;
  double baseline_m = 0.1;  ///< Baseline of a stereo camera with the same errors.
};

/// A depth camera in the place of `camera`, pixel for pixel, with images in mm.
[[nodiscard]] std::string depth_yaml(const Camera& camera, const DepthCameraFigures& figures,
                                     const std::string& comment);

/// The inertial sensor, which is the body frame.
[[nodiscard]] std::string imu_yaml(const ImuNoise& noise, const std::string& comment);

/// The world's true objects, as read_objects() of modules/objects reads them: class and upright box
/// of each object. An object of two classes has an entry for each.
[[nodiscard]] std::string true_objects_json(const World& world, const LabelPalette& palette);

/// The world's true mesh as binary little-endian PLY: vertices x, y, z [m], faces with their class
/// as `label` and its colour as red, green, blue.
[[nodiscard]] std::vector<std::uint8_t> world_ply(const World& world, const LabelPalette& palette);

}  // namespace km
