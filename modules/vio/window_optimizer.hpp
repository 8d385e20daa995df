#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "modules/vio/window.hpp"

namespace km {

/// Gauss-Newton normal equations of a Window, H dx = -g, over its frames, with every landmark
/// eliminated as it is added (Schur complement). Frame k has the columns 15 k: pose (6), velocity,
/// gyro bias, accelerometer bias. Where the window calibrates, 7 columns of the calibration follow
/// those of the frames. Derivatives by a state that the prior holds are taken at its
/// first estimate. Reprojection errors have a Cauchy loss, applied as a weight.
class WindowEquations {
 public:
  /// Equations for `window`, which must outlive this. `damping`: Levenberg-Marquardt factor on the
  /// diagonal.
  WindowEquations(const Window& window, double damping);

  void add_prior();
  void add_imu(std::size_t frame);  ///< The factor that ends at `frame`.

  /// Adds the observations of `landmark` and eliminates it; with `keyframes_only`, those in
  /// keyframes. A landmark seen in fewer than two frames adds nothing. add_images() must follow.
  void add_landmark(const WindowLandmark& landmark, bool keyframes_only = false);

  /// Adds what landmarks say of the images to the equations of states and calibration: once, after
  /// the last landmark.
  void add_images();

  /// The above for the whole window.
  void add_all();

  [[nodiscard]] const Eigen::MatrixXd& H() const { return H_; }  ///< Lower triangle only.
  [[nodiscard]] const Eigen::VectorXd& g() const { return g_; }
  [[nodiscard]] double cost() const { return cost_; }  ///< Of what was added.

  /// Solution for the frames; empty if H is not positive definite.
  [[nodiscard]] Eigen::VectorXd solve() const;

  /// Moves every state and landmark, and the calibration, of `target`, a window of the same
  /// structure, by `dx` and the landmarks' part of the solution that follows from it.
  void apply(const Eigen::VectorXd& dx, Window& target) const;

 private:
  // An eliminated landmark: dl = -(V_inverse b + sum V_inverse W_k^T dx_k).
  struct Eliminated {
    std::size_t landmark = 0;
    Eigen::Vector3d step = Eigen::Vector3d::Zero();  // V_inverse b
    std::size_t first = 0, count = 0;                // into couplings_
  };
  struct Coupling {
    std::size_t frame = 0;
    Eigen::Matrix<double, 6, 3> W;
    Eigen::Matrix<double, 6, 3> Y;  // W V_inverse
  };

  [[nodiscard]] Vector6 image_step(const Eigen::VectorXd& dx, std::size_t frame) const;

  const Window& window_;
  double damping_;
  std::vector<OdometryState> linearization_;  // per frame, where derivatives are taken
  std::vector<SE3> images_;                   // per frame, where the body was at the image
  std::vector<ImagePose> image_linearization_;
  Eigen::MatrixXd images_H_;  // by the pose at each image (6), landmarks eliminated
  Eigen::VectorXd images_g_;
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_;
  double cost_ = 0.0;
  std::vector<Eliminated> eliminated_;
  std::vector<Coupling> couplings_;
};

/// The cost of the whole window without derivatives; infinite if a landmark lies behind a camera
/// that sees it.
[[nodiscard]] double window_cost(const Window& window);

struct WindowSolution {
  int iterations = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
  bool usable = false;  ///< Finite, and no worse than at the start.
};

/// Minimises the window's cost over all states and landmarks, in place: at most `max_iterations`
/// Levenberg-Marquardt steps on WindowEquations, fewer on convergence. Derivatives by what the
/// prior holds are first estimates. (Ceres reaches the same minimum, at more time an image: 6.8 ms
/// against 4.3 on MH_01_easy, most of it for building a problem of some 2000 residual blocks.)
WindowSolution optimize(Window& window, int max_iterations);

/// Removes a frame and its observations, and landmarks that no frame sees any more. The inertial
/// factors on its two sides are the caller's.
void forget_frame(Window& window, std::size_t frame);

/// Replaces the oldest frame by a prior on those that it shares information with: its inertial
/// factor, the prior so far, and the observations in keyframes of every landmark that it has seen,
/// linearised at the current estimates, or at the first ones where the prior held a state already.
/// These landmarks begin anew with what later images see of them. The next frame becomes a
/// keyframe: the prior holds it. Precondition: two frames at least, an inertial factor between the
/// first two.
void marginalize_oldest(Window& window);

}  // namespace km
