#include "modules/vio/window.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/symmetric_eigen.hpp"

namespace km {

ImagePose ImagePose::at(const OdometryState& state, const Eigen::Vector3d& gyro, double shift_s) {
  ImagePose image;
  const Eigen::Vector3d rate = gyro - state.gyro_bias;
  const Eigen::Matrix3d turn = so3_exp(shift_s * rate);
  const Eigen::Matrix3d R = state.T_odom_body.linear() * turn;
  image.T_odom_body = make_pose(R, state.T_odom_body.translation() + shift_s * state.v_odom);
  image.by_state = turn.transpose();
  image.by_calibration << rate, Eigen::Matrix<double, 3, 6>::Identity(),
      R.transpose() * state.v_odom, Eigen::Matrix<double, 3, 6>::Zero();
  image.by_calibration.bottomRightCorner<3, 3>().setIdentity();
  return image;
}

namespace {

constexpr double kRankTolerance = 1e-12;

// S H S = V diag(lambda) V^T with S = diag(H)^-1/2, so that units do not decide the rank.
struct ScaledEigen {
  Eigen::VectorXd scale;
  Eigen::MatrixXd V;
  Eigen::VectorXd lambda;
  Eigen::Index first = 0;  // index of the first eigenvalue that counts
};

ScaledEigen decompose(const Eigen::MatrixXd& H) {
  ScaledEigen e;
  e.scale = H.diagonal().unaryExpr([](double h) { return h > 0.0 ? 1.0 / std::sqrt(h) : 0.0; });
  SymmetricEigen eigen = symmetric_eigen(e.scale.asDiagonal() * H * e.scale.asDiagonal());
  e.V = std::move(eigen.vectors);
  e.lambda = std::move(eigen.values);
  const double least = kRankTolerance * std::max(e.lambda(e.lambda.size() - 1), 0.0);
  while (e.first < e.lambda.size() && !(e.lambda(e.first) > least)) ++e.first;
  return e;
}

}  // namespace

SquareRootPrior marginalize(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                            Eigen::Index count) {
  const Eigen::Index kept = H.rows() - count;
  Eigen::MatrixXd H_kept = H.bottomRightCorner(kept, kept);
  Eigen::VectorXd g_kept = g.tail(kept);
  if (count > 0) {
    const ScaledEigen e = decompose(H.topLeftCorner(count, count));
    const Eigen::Index rank = count - e.first;
    // W^T W is the pseudo-inverse of the block of H to be eliminated.
    const Eigen::MatrixXd W = e.lambda.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal() *
                              e.V.rightCols(rank).transpose() * e.scale.asDiagonal();
    const Eigen::MatrixXd A = W * H.topRightCorner(count, kept);
    H_kept.noalias() -= A.transpose() * A;
    g_kept.noalias() -= A.transpose() * (W * g.head(count));
  }
  if (kept == 0) return {};
  const ScaledEigen e = decompose(H_kept);
  const Eigen::Index rank = kept - e.first;
  const Eigen::VectorXd root = e.lambda.tail(rank).cwiseSqrt();
  const Eigen::MatrixXd V_T = e.V.rightCols(rank).transpose();
  const Eigen::VectorXd unscale =
      e.scale.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  SquareRootPrior prior;
  prior.J = root.asDiagonal() * V_T * unscale.asDiagonal();
  prior.r = root.cwiseInverse().asDiagonal() * (V_T * (e.scale.asDiagonal() * g_kept));
  return prior;
}

Eigen::VectorXd prior_offset(const StatePrior& prior, std::span<const OdometryState* const> states,
                             const CameraCalibration& calibration) {
  Eigen::VectorXd dx(prior.dimension());
  for (std::size_t k = 0; k < states.size(); ++k) {
    const OdometryState& from = prior.linearization[k];
    const Eigen::Index column = k == 0 ? 0 : 9 + 6 * static_cast<Eigen::Index>(k);
    dx.segment<6>(column) = local_coordinates(from.T_odom_body, states[k]->T_odom_body);
    if (k == 0)
      dx.segment<9>(6) << states[k]->v_odom - from.v_odom, states[k]->gyro_bias - from.gyro_bias,
          states[k]->accel_bias - from.accel_bias;
  }
  if (prior.calibrates)
    dx.tail<kCalibrationSize>() = prior.calibration.local_coordinates_to(calibration);
  return dx;
}

namespace {

constexpr int kRefinements = 3;
constexpr double kMaxRelativeSigma = 1.0 / 3.0;

// Minimises the sum of squared distances to all rays.
std::optional<Eigen::Vector3d> nearest_to_rays(const Window& window, std::span<const SE3> images,
                                               const WindowLandmark& landmark) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const WindowObservation& o : landmark.observations)
    for (std::size_t c = 0; c < 2; ++c) {
      if (!o.bearings[c]) continue;
      const ViewModel& view = window.views[c];
      const SE3& T_odom_body = images[o.frame];
      const Eigen::Matrix3d R_odom_cam = T_odom_body.linear() * view.R_cam_body.transpose();
      const Eigen::Vector3d origin = T_odom_body.translation() - R_odom_cam * view.t_cam_body;
      const Eigen::Vector3d ray = (R_odom_cam * o.bearings[c]->homogeneous()).normalized();
      const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - ray * ray.transpose();
      A += P;
      b += P * origin;
    }
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(A);
  if (ldlt.info() != Eigen::Success || ldlt.vectorD().minCoeff() < 1e-10) return std::nullopt;
  return ldlt.solve(b);
}

// Moves the bearings to the stamp for a readout time that is longer by `longer_s`.
void move_by_readout(double longer_s, WindowObservation& observation) {
  for (std::size_t c = 0; c < 2; ++c)
    if (observation.bearings[c]) *observation.bearings[c] -= longer_s * observation.by_readout[c];
}

struct PointEquations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double squared_error = 0.0;
  int count = 0;
};

std::optional<PointEquations> equations(const Window& window, std::span<const SE3> images,
                                        const WindowLandmark& landmark,
                                        const Eigen::Vector3d& p_odom) {
  PointEquations e;
  ReprojectionTerm term;
  for (const WindowObservation& o : landmark.observations)
    for (std::size_t c = 0; c < 2; ++c) {
      if (!o.bearings[c]) continue;
      const SE3& T = images[o.frame];
      if (!linearize_reprojection(window.views[c], *o.bearings[c], T, T, p_odom, term))
        return std::nullopt;
      e.H.noalias() += term.J_point.transpose() * term.J_point;
      e.g.noalias() += term.J_point.transpose() * term.r;
      e.squared_error += term.r.squaredNorm();
      ++e.count;
    }
  return e;
}

}  // namespace

std::size_t frame_index(const Window& window, std::uint64_t id) {
  const auto it = std::lower_bound(window.frames.begin(), window.frames.end(), id,
                                   [](const WindowFrame& f, std::uint64_t v) { return f.id < v; });
  const auto index = static_cast<std::size_t>(it - window.frames.begin());
  return it != window.frames.end() && it->id == id ? index : window.frames.size();
}

std::vector<FirstEstimate> first_estimates(const Window& window) {
  std::vector<FirstEstimate> result(window.frames.size());
  for (std::size_t k = 0; k < window.prior.frames.size(); ++k) {
    FirstEstimate& estimate = result[frame_index(window, window.prior.frames[k])];
    estimate.pose = window.prior.linearization[k].T_odom_body;
    if (k == 0) estimate.motion = window.prior.linearization[k];
  }
  return result;
}

void calibrate(Window& window, const CameraCalibration& calibration) {
  const double longer_s = calibration.readout_s - window.calibration.readout_s;
  if (longer_s != 0.0)
    for (WindowLandmark& landmark : window.landmarks)
      for (WindowObservation& o : landmark.observations) move_by_readout(longer_s, o);
  window.calibration = calibration;
  const SE3 T_rig_body = calibration.T_body_rig.inverse();
  for (std::size_t c = 0; c < 2; ++c) {
    const ViewModel& rig = window.rig_views[c];
    window.views[c].R_cam_body = rig.R_cam_body * T_rig_body.linear();
    window.views[c].t_cam_body = rig.R_cam_body * T_rig_body.translation() + rig.t_cam_body;
    window.views[c].weight = rig.weight;
  }
}

ImagePose image_pose(const Window& window, const WindowFrame& frame, const OdometryState& state) {
  return ImagePose::at(state, frame.gyro, window.calibration.offset_s - frame.offset_s);
}

std::vector<SE3> image_poses(const Window& window) {
  std::vector<SE3> poses;
  for (const WindowFrame& frame : window.frames)
    poses.push_back(window.calibrates ? image_pose(window, frame, frame.state).T_odom_body
                                      : frame.state.T_odom_body);
  return poses;
}

void observe(Window& window, const TrackedFrame& tracked) {
  window.frames.back().features = static_cast<int>(tracked.features.size());
  std::vector<WindowLandmark> added;
  auto at = window.landmarks.begin();
  for (const TrackedFeature& feature :
       tracked.features) {  // both lists ascend, so one pass suffices
    WindowObservation observation{window.frames.size() - 1,
                                  {feature.left, feature.right},
                                  {feature.left_by_readout, feature.right_by_readout}};
    move_by_readout(window.calibration.readout_s, observation);
    while (at != window.landmarks.end() && at->id < feature.id) ++at;
    if (at != window.landmarks.end() && at->id == feature.id)
      at->observations.push_back(observation);
    else
      added.push_back({feature.id, Eigen::Vector3d::Zero(), false, {observation}});
  }
  const auto middle = static_cast<std::ptrdiff_t>(window.landmarks.size());
  std::move(added.begin(), added.end(), std::back_inserter(window.landmarks));
  std::inplace_merge(window.landmarks.begin(), window.landmarks.begin() + middle,
                     window.landmarks.end(),
                     [](const auto& a, const auto& b) { return a.id < b.id; });
}

bool tracked_now(const Window& window, const WindowLandmark& landmark) {
  return !landmark.observations.empty() &&
         landmark.observations.back().frame + 1 == window.frames.size();
}

void locate(const Window& window, std::span<const SE3> images, double max_error,
            WindowLandmark& landmark) {
  landmark.located = false;
  std::optional<Eigen::Vector3d> p = nearest_to_rays(window, images, landmark);
  if (!p) return;
  for (int k = 0; k < kRefinements; ++k) {
    const auto e = equations(window, images, landmark, *p);
    if (!e) return;
    *p -= e->H.ldlt().solve(e->g);
  }
  const auto e = equations(window, images, landmark, *p);
  if (!e || e->squared_error > e->count * max_error * max_error) return;
  const Eigen::Vector3d ray = *p - images[landmark.observations.back().frame].translation();
  const double range = ray.norm();
  const double variance = ray.dot(e->H.ldlt().solve(ray)) / (range * range);
  if (!(variance < std::pow(kMaxRelativeSigma * range, 2))) return;
  landmark.p_odom = *p;
  landmark.located = true;
}

}  // namespace km
