#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace km {

/// Model of a lens, and the order of its coefficients.
enum class LensModel {
  /// k1, k2, p1, p2[, k3[, k4, k5, k6]]: Brown-Conrady as in OpenCV's cv::projectPoints; with eight
  /// coefficients the rational model. ROS calls them plumb_bob and rational_polynomial.
  kRadialTangential,
  /// k1, k2, k3, k4: Kannala and Brandt, "A generic camera model and calibration method for
  /// conventional, wide-angle, and fish-eye lenses", 2006, in the form of OpenCV's cv::fisheye; kb4
  /// of Basalt.
  kEquidistant,
  /// xi, k1, k2, p1, p2: Mei and Rives, "Single view point omnidirectional camera calibration from
  /// planar grids", 2007, as cv::omnidir.
  kOmnidirectional,
  /// xi, alpha[, beta]: Usenko, Demmel and Cremers, "The double sphere camera model", 2018; ds of
  /// Basalt. With a xi of 0 and with beta: Khomutenko, Garcia and Martinet, "An enhanced unified
  /// camera model", 2016; eucm of Basalt and Kalibr. That model is the one without beta for
  /// bearings and points times the root of beta.
  kDoubleSphere,
};

/// "radial-tangential", "equidistant", "omnidirectional" or "double sphere".
[[nodiscard]] std::string to_string(LensModel model);

/// A lens maps a bearing, a point on the plane z = 1 of the camera frame, to a point of the image,
/// in focal lengths from the principal point. On the axis all models magnify by 1. The focal
/// lengths of omnidirectional and double-sphere calibrations are the ones here times 1 + xi.
///
/// A lens has bearings within a disc about its axis, and is one-to-one there. The disc ends before
/// the model folds back, and at 80 degrees. The plane z = 1 extends to 90 degrees only at infinity.
/// A pixel of an equidistant lens covers 33 times as much of the plane at 80 degrees as on the
/// axis, and 132 times at 85 degrees. Errors of a pixel would then be as large as the measured
/// bearing.
class Lens {
 public:
  static constexpr double kMaxBearing = 5.671281819617709;  ///< tan(80 degrees)
  /// Coefficients of any model; unused ones are 0.
  using Coefficients = std::array<double, 9>;

  /// No distortion.
  Lens() = default;

  /// Throws std::invalid_argument for a wrong number of coefficients and for one that is not
  /// finite. Throws it also for a xi below 0 (omnidirectional) or not within (-1, 1] (double
  /// sphere), for an alpha outside [0, 1] and for a beta that is not positive.
  Lens(LensModel model, const std::vector<double>& coefficients);

  [[nodiscard]] LensModel model() const { return model_; }
  /// Coefficients that were passed to the constructor.
  [[nodiscard]] std::span<const double> coefficients() const {
    return {coefficients_.data(), count_};
  }
  /// True if no bearing is moved.
  [[nodiscard]] bool is_ideal() const;

  /// Radius of the disc of bearings.
  [[nodiscard]] double max_bearing() const { return max_bearing_; }

  /// Image of `bearing`; nullopt outside the disc.
  [[nodiscard]] std::optional<Eigen::Vector2d> distorted(const Eigen::Vector2d& bearing) const;

  /// The bearing within the disc with the image `point`; nullopt if there is none.
  [[nodiscard]] std::optional<Eigen::Vector2d> undistorted(const Eigen::Vector2d& point) const;

  /// True for equal models and coefficients; missing coefficients count as 0.
  [[nodiscard]] bool operator==(const Lens& other) const {
    return model_ == other.model_ && coefficients_ == other.coefficients_;
  }

 private:
  LensModel model_ = LensModel::kRadialTangential;
  std::size_t count_ = 4;
  Coefficients coefficients_ = {};
  double max_bearing_ = kMaxBearing;
  double max_plane_ = kMaxBearing;  // bound on the radius, or the angle [rad], in polynomials
};

}  // namespace km
