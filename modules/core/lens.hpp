#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace km {

/// What a lens does to bearings, and the order of its coefficients.
enum class LensModel {
  /// k1, k2, p1, p2[, k3[, k4, k5, k6]]: Brown-Conrady as OpenCV's cv::projectPoints has it, with
  /// eight coefficients the rational one. ROS calls them plumb_bob and rational_polynomial.
  kRadialTangential,
  /// k1, k2, k3, k4: Kannala and Brandt, "A generic camera model and calibration method for
  /// conventional, wide-angle, and fish-eye lenses", 2006, in the form of OpenCV's cv::fisheye; kb4
  /// of Basalt.
  kEquidistant,
  /// xi, k1, k2, p1, p2: Mei and Rives, "Single view point omnidirectional camera calibration from
  /// planar grids", 2007, as cv::omnidir.
  kOmnidirectional,
  /// xi, alpha: Usenko, Demmel and Cremers, "The double sphere camera model", 2018; ds of Basalt.
  kDoubleSphere,
};

/// "radial-tangential", "equidistant", "omnidirectional" or "double sphere".
[[nodiscard]] std::string to_string(LensModel model);

/// A lens: it puts a bearing, a point on the plane z = 1 of the camera frame, at a point of the
/// image, in focal lengths from the principal point. On the axis all models magnify by 1; the focal
/// lengths of omnidirectional and double-sphere calibrations are those here times 1 + xi.
///
/// A lens has bearings within a disc about its axis. There it is one-to-one: the disc ends before
/// the model folds back, and at 80 degrees. Near 90 degrees the plane z = 1 holds no bearing: at 80
/// degrees a pixel of an equidistant lens covers 33 times as much of it as on the axis, at 85 132
/// times, so that errors of a pixel are as large as what is measured.
class Lens {
 public:
  static constexpr double kMaxBearing = 5.671281819617709;  ///< tan(80 degrees)
  using Coefficients = std::array<double, 9>;               ///< Of any model; the rest are 0.

  /// No distortion.
  Lens() = default;

  /// Throws std::invalid_argument for a number of coefficients other than the model's, one that is
  /// not finite, a xi below 0 (omnidirectional) or not within (-1, 1] (double sphere), and an alpha
  /// outside [0, 1].
  Lens(LensModel model, const std::vector<double>& coefficients);

  [[nodiscard]] LensModel model() const { return model_; }
  /// As many as were given.
  [[nodiscard]] std::span<const double> coefficients() const {
    return {coefficients_.data(), count_};
  }
  /// True if every bearing stays where it is.
  [[nodiscard]] bool is_ideal() const;

  /// Radius of the disc of bearings.
  [[nodiscard]] double max_bearing() const { return max_bearing_; }

  /// nullopt outside the disc.
  [[nodiscard]] std::optional<Eigen::Vector2d> distorted(const Eigen::Vector2d& bearing) const;

  /// The bearing within the disc that comes to `point`; nullopt if none does.
  [[nodiscard]] std::optional<Eigen::Vector2d> undistorted(const Eigen::Vector2d& point) const;

  /// The same model and coefficients; those that are not given are 0.
  [[nodiscard]] bool operator==(const Lens& other) const {
    return model_ == other.model_ && coefficients_ == other.coefficients_;
  }

 private:
  LensModel model_ = LensModel::kRadialTangential;
  std::size_t count_ = 4;
  Coefficients coefficients_ = {};
  double max_bearing_ = kMaxBearing;
  double max_plane_ = kMaxBearing;  // of what polynomials are applied to: points, or angles [rad]
};

}  // namespace km
