#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "modules/vio/window.hpp"

namespace km {

/// Gauss-Newton normal equations of a Window, H dx = -g, over its frames, with every landmark
/// eliminated as it is added (Schur complement). Frame k has the columns 15 k: pose (6), velocity,
/// gyro bias, accelerometer bias. If the window calibrates, 8 columns of the calibration follow
/// those of the frames. Derivatives by a state that the prior holds are taken at its first
/// estimate. Reprojection errors have a Cauchy loss, applied as a weight.
class WindowEquations {
 public:
  /// Equations for `window`, which must outlive this. `damping`: Levenberg-Marquardt factor on the
  /// diagonal.
  WindowEquations(const Window& window, double damping);

  void add_prior();
  void add_imu(std::size_t frame);  ///< Adds the inertial factor that ends at `frame`.

  /// Adds the observations of `landmark`, or those in keyframes (`keyframes_only`), and eliminates
  /// the landmark. A landmark that is not located, or seen in fewer than two frames, adds nothing.
  /// Call add_images() afterwards.
  void add_landmark(const WindowLandmark& landmark, bool keyframes_only = false);

  /// add_landmark() collects terms in the poses at image times. This function converts these terms
  /// to states and calibration, and adds them to the equations. Call once, after the last landmark.
  void add_images();

  /// Adds the prior, all inertial factors and all landmarks of the window, and calls add_images().
  void add_all();

  [[nodiscard]] const Eigen::MatrixXd& H() const { return H_; }  ///< Lower triangle only.
  [[nodiscard]] const Eigen::VectorXd& g() const { return g_; }

  /// Solution for the frames; empty if H is not positive definite.
  [[nodiscard]] Eigen::VectorXd solve() const;

  /// Ratio of the measured variance of D dx to that by the assumed errors of the image points.
  /// Here X = H^-1 D^T. The measured variance is the scatter of the changes by single landmarks. It
  /// includes errors that the observations of a landmark share. It excludes errors that all
  /// landmarks share. The ratio is the mean over six directions. At least 1 if there are too few
  /// landmarks to measure it.
  /// White proposes this estimator in "A heteroskedasticity-consistent covariance matrix
  /// estimator", Econometrica 1980.
  [[nodiscard]] double error_ratio(const Eigen::Matrix<double, Eigen::Dynamic, 6>& X) const;

  /// Moves the states and the calibration of `target` by `dx`, and its landmarks by the steps that
  /// follow from `dx`. `target` is a window of the same structure.
  void apply(const Eigen::VectorXd& dx, Window& target) const;

 private:
  // An eliminated landmark: dl = -(V_inverse b + sum V_inverse W_k^T dx_k), over the images and the
  // readout time.
  struct Eliminated {
    std::size_t landmark = 0;
    Eigen::Vector3d step = Eigen::Vector3d::Zero();        // V_inverse b
    Eigen::Vector3d by_readout = Eigen::Vector3d::Zero();  // V_inverse W^T of the readout time
    std::size_t first = 0, count = 0;                      // range in couplings_
  };
  // Hessian between a landmark and the pose of one image.
  struct Coupling {
    std::size_t frame = 0;
    Eigen::Matrix<double, 6, 3> W;
    Eigen::Matrix<double, 6, 3> Y;  // W V_inverse
    Vector6 g = Vector6::Zero();    // gradient by the pose, landmark eliminated
  };

  // The terms of a landmark that is to be eliminated.
  struct PointTerms {
    Eigen::Matrix3d V = Eigen::Matrix3d::Zero();           // Hessian
    Eigen::Vector3d b = Eigen::Vector3d::Zero();           // gradient
    Eigen::Vector3d by_readout = Eigen::Vector3d::Zero();  // Hessian with the readout time
  };

  void add_observation(const WindowObservation& o, const Eigen::Vector3d& p_odom,
                       PointTerms& point);
  void eliminate(PointTerms& point, Eliminated& landmark);
  [[nodiscard]] Vector6 image_step(const Eigen::VectorXd& dx, std::size_t frame) const;

  const Window& window_;
  double damping_;
  std::vector<OdometryState> linearization_;  // linearisation point of each frame
  std::vector<SE3> images_;                   // pose of the body at the image of each frame
  std::vector<ImagePose> image_linearization_;
  // Hessian over the pose of each image (6 rows each) and, if the window calibrates, the readout
  // time (last row), landmarks eliminated.
  Eigen::MatrixXd images_H_;
  Eigen::VectorXd images_g_;
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_;
  std::vector<Eliminated> eliminated_;
  std::vector<Coupling> couplings_;
};

struct WindowSolution {
  int iterations = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
  bool usable = false;  ///< True if the final cost is finite.
};

/// Minimises the window's cost over all states and landmarks, in place: at most `max_iterations`
/// Levenberg-Marquardt steps on WindowEquations, fewer on convergence. Derivatives by variables
/// that the prior holds are taken at first estimates. (Ceres reaches the same minimum, but
/// needs 6.8 ms per image instead of 4.3 on MH_01_easy, mostly to build a problem of some 2000
/// residual blocks.)
WindowSolution optimize(Window& window, int max_iterations);

/// Removes a frame with its observations, and the landmarks that no other frame sees. The caller
/// replaces the inertial factors before and after the frame by one.
void forget_frame(Window& window, std::size_t frame);

/// Replaces the oldest frame by a prior on the frames that share information with it. The new prior
/// contains the former prior, the inertial factor after the oldest frame, and the observations in
/// keyframes of every landmark that the oldest frame has seen. The terms are linearised at the
/// current estimates, or at the first estimates of states that the former prior held. The landmarks
/// lose their position and are located again from observations of later images. The second frame
/// becomes a keyframe, because the prior holds it. Precondition: at least two frames, and an
/// inertial factor between the first two.
void marginalize_oldest(Window& window);

}  // namespace km
