#include "modules/absolute_fixes/geodetic.hpp"

#include <cmath>
#include <numbers>

namespace km {
namespace {

constexpr double kSemiMajorAxis_m = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kDegree = std::numbers::pi / 180.0;

}  // namespace

Eigen::Vector3d ecef_of(const GeodeticPoint& point) {
  constexpr double kSquaredEccentricity = kFlattening * (2.0 - kFlattening);
  const double latitude = point.latitude_deg * kDegree, longitude = point.longitude_deg * kDegree;
  const double sine = std::sin(latitude);
  const double N_m = kSemiMajorAxis_m / std::sqrt(1.0 - kSquaredEccentricity * sine * sine);
  const double from_axis_m = (N_m + point.altitude_m) * std::cos(latitude);
  return {from_axis_m * std::cos(longitude), from_axis_m * std::sin(longitude),
          ((1.0 - kSquaredEccentricity) * N_m + point.altitude_m) * sine};
}

EnuFrame::EnuFrame(const GeodeticPoint& datum) : datum_ecef_(ecef_of(datum)) {
  const double latitude = datum.latitude_deg * kDegree, longitude = datum.longitude_deg * kDegree;
  const Eigen::Vector3d east(-std::sin(longitude), std::cos(longitude), 0.0);
  const Eigen::Vector3d up(std::cos(latitude) * std::cos(longitude),
                           std::cos(latitude) * std::sin(longitude), std::sin(latitude));
  R_enu_ecef_ << east.transpose(), up.cross(east).transpose(), up.transpose();
}

}  // namespace km
