#pragma once

#include <Eigen/Core>

namespace km {

/// A point by its coordinates in WGS 84; the altitude is above the ellipsoid.
struct GeodeticPoint {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;
};

/// Earth-centred, earth-fixed coordinates [m] (NIMA TR8350.2, third edition, Eq. (4-14)).
[[nodiscard]] Eigen::Vector3d ecef_of(const GeodeticPoint& point);

/// The frame with x east, y north and z up at a datum. It is a tangent plane and exact at any
/// distance, but its z is the vertical only at the datum: 1 mrad off at 6.4 km.
class EnuFrame {
 public:
  explicit EnuFrame(const GeodeticPoint& datum);

  /// [m]
  [[nodiscard]] Eigen::Vector3d position_of(const GeodeticPoint& point) const {
    return R_enu_ecef_ * (ecef_of(point) - datum_ecef_);
  }

 private:
  Eigen::Vector3d datum_ecef_;
  Eigen::Matrix3d R_enu_ecef_;
};

}  // namespace km
