#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/camera_calibration.hpp"
#include "modules/core/odometry.hpp"

namespace km {

/// Quadratic cost 1/2 |J dx + r|^2.
struct SquareRootPrior {
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
};

/// Eliminates the first `count` variables of the quadratic 1/2 dx^T H dx + g^T dx by their Schur
/// complement. Returns the marginal on the other variables in square-root form: J^T J and J^T r are
/// the marginal H and g. Directions without information (below 1e-12 of the largest, after scaling
/// the diagonal to one) get no rows. H symmetric, positive semi-definite; 0 <= count <= size. Cubic
/// in the size. The method is that of OKVIS (Leutenegger et al., IJRR 2015, Sec. 4.3) and VINS-Mono
/// (Qin et al., TRO 2018, Sec. VI-D).
[[nodiscard]] SquareRootPrior marginalize(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                                          Eigen::Index count);

/// Prior of marginalised states on the oldest states of a window, a square-root prior on dx =
/// [pose_0 (6), motion_0 (9), pose_1 (6), pose_2 (6), ..., calibration (8)]. dx are the retracted
/// differences to `linearization` and `calibration`. Only the first state has its velocity and
/// biases in dx. The calibration is in dx only if `calibrates`.
struct StatePrior {
  std::vector<std::uint64_t> frames;         ///< Ids; equally long as linearization.
  std::vector<OdometryState> linearization;  ///< First estimates, at which the prior was made.
  CameraCalibration calibration;             ///< First estimate of the calibration.
  bool calibrates = false;
  Eigen::MatrixXd J;
  Eigen::VectorXd r;

  /// Dimension without the calibration.
  [[nodiscard]] Eigen::Index states_dimension() const {
    return frames.empty() ? 0 : 9 + 6 * static_cast<Eigen::Index>(frames.size());
  }
  [[nodiscard]] Eigen::Index dimension() const {
    return states_dimension() + (calibrates ? kCalibrationSize : 0);
  }
};

/// dx of StatePrior for the current `states`, one for each of prior.frames, and calibration.
[[nodiscard]] Eigen::VectorXd prior_offset(const StatePrior& prior,
                                           std::span<const OdometryState* const> states,
                                           const CameraCalibration& calibration = {});

}  // namespace km
