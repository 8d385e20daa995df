#include "modules/simulation/motion/uniform_spline.hpp"

namespace km {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Row k: coefficients of weight k by powers of u.
const Matrix6d& coefficients() {
  static const Matrix6d matrix = [] {
    Matrix6d M;
    M << 1, -5, 10, -10, 5, -1,    //
        26, -50, 20, 20, -20, 5,   //
        66, 0, -60, 0, 30, -10,    //
        26, 50, 20, -20, -20, 10,  //
        1, 5, 10, 10, 5, -5,       //
        0, 0, 0, 0, 0, 1;
    return Matrix6d(M / 120.0);
  }();
  return matrix;
}

}  // namespace

QuinticBasis QuinticBasis::at(double u) {
  const double u2 = u * u, u3 = u2 * u, u4 = u3 * u;
  Weights powers, slope, bend;
  powers << 1.0, u, u2, u3, u4, u4 * u;
  slope << 0.0, 1.0, 2.0 * u, 3.0 * u2, 4.0 * u3, 5.0 * u4;
  bend << 0.0, 0.0, 2.0, 6.0 * u, 12.0 * u2, 20.0 * u3;
  const Matrix6d& M = coefficients();
  return {M * powers, M * slope, M * bend};
}

}  // namespace km
