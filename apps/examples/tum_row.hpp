#pragma once

#include <Eigen/Geometry>
#include <ostream>

/// Writes a pose as a row of a TUM trajectory: t [s], position [m], quaternion x, y, z, w.
inline void write_tum_row(std::ostream& out, double t_s, const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  out.precision(17);
  out << t_s << ' ' << T.translation().transpose() << ' ' << q.coeffs().transpose() << '\n';
}
