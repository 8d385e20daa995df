#include "modules/vio/window_optimizer.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

// Cauchy loss rho(s) = c^2 log(1 + s / c^2) of a squared error s; its derivative is the weight.
double cauchy(double s, double c) {
  return c * c * std::log1p(s / (c * c));
}
double cauchy_weight(double s, double c) {
  return 1.0 / (1.0 + s / (c * c));
}

std::vector<const OdometryState*> prior_states(const Window& window) {
  std::vector<const OdometryState*> states;
  for (const std::uint64_t id : window.prior.frames)
    states.push_back(&window.frames[frame_index(window, id)].state);
  return states;
}

// Number of landmarks below which their scatter does not measure the errors: 4 for each unknown.
constexpr double kLeastLandmarks = 24.0;

constexpr double kInitialDamping = 1e-6;
constexpr double kMaxDamping = 1e3;
constexpr double kSmallStep = 1e-6;  // largest of rad, m, m/s: far below the resolution of images

// Variables that an iteration changes, saved so that it can be undone.
struct Snapshot {
  CameraCalibration calibration;
  std::vector<OdometryState> states;
  std::vector<Eigen::Vector3d> points;

  explicit Snapshot(const Window& window) : calibration(window.calibration) {
    for (const WindowFrame& frame : window.frames) states.push_back(frame.state);
    for (const WindowLandmark& landmark : window.landmarks) points.push_back(landmark.p_odom);
  }
  void restore(Window& window) const {
    if (window.calibrates) calibrate(window, calibration);
    for (std::size_t k = 0; k < states.size(); ++k) window.frames[k].state = states[k];
    for (std::size_t k = 0; k < points.size(); ++k) window.landmarks[k].p_odom = points[k];
  }
};

bool seen_by_oldest(const WindowLandmark& landmark) {
  return landmark.located && landmark.observations.front().frame == 0;
}

// Frames that the marginalisation of the oldest frame involves, including that frame.
std::vector<std::size_t> concerned_frames(const Window& window) {
  std::vector<bool> concerned(window.frames.size(), false);
  concerned[0] = concerned[1] = true;
  for (const std::uint64_t id : window.prior.frames) concerned[frame_index(window, id)] = true;
  for (const WindowLandmark& landmark : window.landmarks) {
    if (!seen_by_oldest(landmark)) continue;
    for (const WindowObservation& o : landmark.observations)
      if (window.frames[o.frame].keyframe) concerned[o.frame] = true;
  }
  std::vector<std::size_t> frames;
  for (std::size_t k = 0; k < concerned.size(); ++k)
    if (concerned[k]) frames.push_back(k);
  return frames;
}

// Prior that replaces the oldest frame.
StatePrior prior_after_oldest(const Window& window) {
  WindowEquations equations(window, 0.0);
  equations.add_prior();
  equations.add_imu(1);
  for (const WindowLandmark& landmark : window.landmarks)
    if (seen_by_oldest(landmark)) equations.add_landmark(landmark, true);
  equations.add_images();

  const std::vector<FirstEstimate> held = first_estimates(window);
  std::vector<Eigen::Index> variables;
  std::vector<const OdometryState*> states;
  StatePrior prior;
  prior.calibrates = window.calibrates;
  prior.calibration = window.calibration;
  for (const std::size_t k : concerned_frames(window)) {
    for (Eigen::Index v = 0; v < (k <= 1 ? 15 : 6); ++v)
      variables.push_back(15 * static_cast<Eigen::Index>(k) + v);
    if (k == 0) continue;
    const WindowFrame& frame = window.frames[k];
    states.push_back(&frame.state);
    prior.frames.push_back(frame.id);
    prior.linearization.push_back(held[k].applied_to(frame.state));
  }
  for (auto v = 15 * static_cast<Eigen::Index>(window.frames.size()); v < equations.g().size(); ++v)
    variables.push_back(v);
  const Eigen::MatrixXd full = equations.H().selfadjointView<Eigen::Lower>();
  const SquareRootPrior root =
      marginalize(full(variables, variables), equations.g()(variables), 15);
  prior.J = root.J;
  // The gradient was taken at the current states; the prior is relative to the first estimates.
  prior.r = root.r - root.J * prior_offset(prior, states, window.calibration);
  return prior;
}

// Without derivatives; infinite if a landmark lies behind a camera that sees it.
double window_cost(const Window& window) {
  double cost = 0.0;
  if (!window.prior.frames.empty()) {
    const auto dx = prior_offset(window.prior, prior_states(window), window.calibration);
    cost += 0.5 * (window.prior.J * dx + window.prior.r).squaredNorm();
  }
  for (std::size_t k = 1; k < window.frames.size(); ++k)
    if (window.frames[k].imu)
      cost += 0.5 * window.frames[k]
                        .imu->error(window.frames[k - 1].state, window.frames[k].state)
                        .squaredNorm();
  const std::vector<SE3> images = image_poses(window);
  Eigen::Vector2d r;
  for (const WindowLandmark& landmark : window.landmarks) {
    if (!landmark.located || landmark.observations.size() < 2) continue;
    for (const WindowObservation& o : landmark.observations)
      for (std::size_t c = 0; c < 2; ++c) {
        if (!o.bearings[c]) continue;
        if (!reprojection_error(window.views[c], *o.bearings[c], images[o.frame], landmark.p_odom,
                                r))
          return std::numeric_limits<double>::infinity();
        cost += 0.5 * cauchy(r.squaredNorm(), window.loss_scale);
      }
  }
  return cost;
}

}  // namespace

WindowEquations::WindowEquations(const Window& window, double damping)
    : window_(window), damping_(damping) {
  const std::vector<FirstEstimate> held = first_estimates(window);
  for (std::size_t k = 0; k < held.size(); ++k) {
    const OdometryState& state =
        linearization_.emplace_back(held[k].applied_to(window.frames[k].state));
    if (window.calibrates)
      image_linearization_.push_back(image_pose(window, window.frames[k], state));
    else
      image_linearization_.emplace_back().T_odom_body = state.T_odom_body;
  }
  images_ = image_poses(window);
  const auto frames = static_cast<Eigen::Index>(window.frames.size());
  const auto n = 15 * frames + (window.calibrates ? kCalibrationSize : 0);
  const auto images = 6 * frames + (window.calibrates ? 1 : 0);
  H_.setZero(n, n);
  g_.setZero(n);
  images_H_.setZero(images, images);
  images_g_.setZero(images);
  couplings_.reserve(8 * window.landmarks.size());
  eliminated_.reserve(window.landmarks.size());
}

void WindowEquations::add_prior() {
  const StatePrior& prior = window_.prior;
  if (prior.frames.empty()) return;
  const Eigen::VectorXd r =
      prior.J * prior_offset(prior, prior_states(window_), window_.calibration) + prior.r;
  const Eigen::MatrixXd H = prior.J.transpose() * prior.J;
  const Eigen::VectorXd g = prior.J.transpose() * r;
  struct Span {
    Eigen::Index from, to, size;
  };
  std::vector<Span> spans;
  for (std::size_t k = 0; k < prior.frames.size(); ++k)
    spans.push_back({k == 0 ? 0 : 9 + 6 * static_cast<Eigen::Index>(k),
                     15 * static_cast<Eigen::Index>(frame_index(window_, prior.frames[k])),
                     k == 0 ? 15 : 6});
  if (prior.calibrates)
    spans.push_back({prior.states_dimension(),
                     15 * static_cast<Eigen::Index>(window_.frames.size()), kCalibrationSize});
  for (const Span& row : spans) {
    g_.segment(row.to, row.size) += g.segment(row.from, row.size);
    for (const Span& col : spans)
      if (col.from <= row.from)
        H_.block(row.to, col.to, row.size, col.size) +=
            H.block(row.from, col.from, row.size, col.size);
  }
}

void WindowEquations::add_imu(std::size_t frame) {
  const WindowFrame& i = window_.frames[frame - 1];
  const WindowFrame& j = window_.frames[frame];
  const ImuTerm term =
      j.imu->linearize(i.state, j.state, linearization_[frame - 1], linearization_[frame]);
  const auto a = 15 * static_cast<Eigen::Index>(frame - 1);
  const auto b = a + 15;
  H_.block<15, 15>(a, a).noalias() += term.J_i.transpose() * term.J_i;
  H_.block<15, 15>(b, a).noalias() += term.J_j.transpose() * term.J_i;
  H_.block<15, 15>(b, b).noalias() += term.J_j.transpose() * term.J_j;
  g_.segment<15>(a).noalias() += term.J_i.transpose() * term.r;
  g_.segment<15>(b).noalias() += term.J_j.transpose() * term.r;
}

void WindowEquations::add_landmark(const WindowLandmark& landmark, bool keyframes_only) {
  if (!landmark.located) return;
  const auto counts = [&](const WindowObservation& o) {
    return !keyframes_only || window_.frames[o.frame].keyframe;
  };
  if (std::count_if(landmark.observations.begin(), landmark.observations.end(), counts) < 2) return;
  PointTerms point;
  const std::size_t first = couplings_.size();
  for (const WindowObservation& o : landmark.observations)
    if (counts(o)) add_observation(o, landmark.p_odom, point);
  eliminated_.push_back({static_cast<std::size_t>(&landmark - window_.landmarks.data()),
                         Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), first,
                         couplings_.size() - first});
  eliminate(point, eliminated_.back());
}

void WindowEquations::add_observation(const WindowObservation& o, const Eigen::Vector3d& p_odom,
                                      PointTerms& point) {
  const auto at = 6 * static_cast<Eigen::Index>(o.frame), last = images_g_.size() - 1;
  Coupling coupling{o.frame, Eigen::Matrix<double, 6, 3>::Zero(),
                    Eigen::Matrix<double, 6, 3>::Zero()};
  Matrix6 A = Matrix6::Zero();
  Vector6 a = Vector6::Zero();
  ReprojectionTerm term;
  for (std::size_t c = 0; c < 2; ++c) {
    const ViewModel& view = window_.views[c];
    if (!o.bearings[c] ||
        !linearize_reprojection(view, *o.bearings[c], images_[o.frame],
                                image_linearization_[o.frame].T_odom_body, p_odom, term))
      continue;
    const double w = cauchy_weight(term.r.squaredNorm(), window_.loss_scale);
    const Eigen::Matrix<double, 6, 2> J_w = w * term.J_pose.transpose();
    A.noalias() += J_w * term.J_pose;
    a.noalias() += J_w * term.r;
    coupling.W.noalias() += J_w * term.J_point;
    point.V.noalias() += w * term.J_point.transpose() * term.J_point;
    point.b.noalias() += w * term.J_point.transpose() * term.r;
    if (!window_.calibrates) continue;
    const Eigen::Vector2d J_readout = view.weight * o.by_readout[c];
    images_H_.block<1, 6>(last, at) += (J_w * J_readout).transpose();
    images_H_(last, last) += w * J_readout.squaredNorm();
    images_g_(last) += w * J_readout.dot(term.r);
    point.by_readout.noalias() += w * term.J_point.transpose() * J_readout;
  }
  images_H_.block<6, 6>(at, at) += A;
  images_g_.segment<6>(at) += a;
  coupling.g = a;
  couplings_.push_back(coupling);
}

void WindowEquations::eliminate(PointTerms& point, Eliminated& landmark) {
  Eigen::Matrix3d& V = point.V;
  V.diagonal() *= 1.0 + damping_;
  // A landmark at infinity keeps its distance. The relative part makes V definite where the images
  // do not determine the distance. The inverse of such a V would be rounding errors, and not its
  // product with W.
  V.diagonal().array() += 1e-9 + 1e-12 * V.trace();
  const Eigen::LLT<Eigen::Matrix3d> llt(V);
  landmark.step = llt.solve(point.b);
  const auto last = images_g_.size() - 1;
  if (window_.calibrates) {
    landmark.by_readout = llt.solve(point.by_readout);
    images_H_(last, last) -= landmark.by_readout.dot(point.by_readout);
    images_g_(last) -= landmark.step.dot(point.by_readout);
  }
  for (std::size_t k = landmark.first; k < couplings_.size(); ++k) {
    Coupling& row = couplings_[k];
    row.Y = llt.solve(row.W.transpose()).transpose();
    const auto at = 6 * static_cast<Eigen::Index>(row.frame);
    const Vector6 by_landmark = row.W * landmark.step;
    row.g -= by_landmark;
    images_g_.segment<6>(at) -= by_landmark;
    if (window_.calibrates)
      images_H_.block<1, 6>(last, at).noalias() -= (row.W * landmark.by_readout).transpose();
    for (std::size_t m = landmark.first; m <= k; ++m)
      images_H_.block<6, 6>(at, 6 * static_cast<Eigen::Index>(couplings_[m].frame)).noalias() -=
          row.Y * couplings_[m].W.transpose();
  }
}

// The poses at the images follow from states and calibration, dx_image = M dx + B dc. The readout
// time, the last row of B, moves bearings and not the images.
void WindowEquations::add_images() {
  const auto frames = static_cast<Eigen::Index>(window_.frames.size());
  Eigen::MatrixXd H = images_H_.selfadjointView<Eigen::Lower>();
  Eigen::VectorXd& g = images_g_;
  if (window_.calibrates) {
    constexpr int kSize = kCalibrationSize;
    Eigen::MatrixXd B = Eigen::MatrixXd::Zero(6 * frames + 1, kSize);
    for (Eigen::Index k = 0; k < frames; ++k)
      B.block<6, kSize - 1>(6 * k, 0) =
          image_linearization_[static_cast<std::size_t>(k)].by_calibration;
    B(6 * frames, kSize - 1) = 1.0;
    Eigen::MatrixXd HB = H * B;
    H_.bottomRightCorner<kSize, kSize>().noalias() += B.transpose() * HB;
    g_.tail<kSize>().noalias() += B.transpose() * g;
    for (Eigen::Index half = 0; half < 2 * frames; ++half) {
      const Eigen::Matrix3d& M = image_linearization_[static_cast<std::size_t>(half / 2)].by_state;
      HB.middleRows<3>(3 * half) = (M.transpose() * HB.middleRows<3>(3 * half)).eval();
      H.middleRows<3>(3 * half) = (M.transpose() * H.middleRows<3>(3 * half)).eval();
      H.middleCols<3>(3 * half) = (H.middleCols<3>(3 * half) * M).eval();
      g.segment<3>(3 * half) = (M.transpose() * g.segment<3>(3 * half)).eval();
    }
    for (Eigen::Index k = 0; k < frames; ++k)
      H_.block<kSize, 6>(15 * frames, 15 * k) += HB.middleRows<6>(6 * k).transpose();
  }
  for (Eigen::Index k = 0; k < frames; ++k) {
    g_.segment<6>(15 * k) += g.segment<6>(6 * k);
    for (Eigen::Index m = 0; m <= k; ++m)
      H_.block<6, 6>(15 * k, 15 * m) += H.block<6, 6>(6 * k, 6 * m);
  }
}

double WindowEquations::error_ratio(const Eigen::Matrix<double, Eigen::Dynamic, 6>& X) const {
  Eigen::Matrix<double, Eigen::Dynamic, 6> x = decltype(x)::Zero(images_H_.rows(), 6);
  for (std::size_t k = 0; k < window_.frames.size(); ++k)
    for (Eigen::Index column = 0; column < 6; ++column)
      x.block<6, 1>(6 * static_cast<Eigen::Index>(k), column) = image_step(X.col(column), k);
  Matrix6 scatter = Matrix6::Zero();
  for (const Eliminated& e : eliminated_) {
    Vector6 change = Vector6::Zero();
    for (const Coupling& c : std::span(couplings_).subspan(e.first, e.count))
      change += x.middleRows<6>(6 * static_cast<Eigen::Index>(c.frame)).transpose() * c.g;
    scatter += change * change.transpose();
  }
  const Eigen::MatrixXd H = images_H_.selfadjointView<Eigen::Lower>();
  const Matrix6 assumed = x.transpose() * H * x;
  const auto landmarks = static_cast<double>(eliminated_.size());
  // Six unknowns are fitted. With less than twelve landmarks this correction ends, before it is
  // infinite.
  const double unbiased = landmarks / std::max(landmarks - 6.0, 0.5 * landmarks);
  const double ratio = unbiased * assumed.ldlt().solve(scatter).trace() / 6.0;
  return landmarks >= kLeastLandmarks && ratio > 0.0 ? ratio : std::max(1.0, ratio);
}

Vector6 WindowEquations::image_step(const Eigen::VectorXd& dx, std::size_t frame) const {
  Vector6 step = dx.segment<6>(15 * static_cast<Eigen::Index>(frame));
  if (!window_.calibrates) return step;
  const ImagePose& image = image_linearization_[frame];
  step << image.by_state * step.head<3>(), image.by_state * step.tail<3>();
  return step + image.by_calibration * dx.tail<kCalibrationSize>().head<kCalibrationSize - 1>();
}

void WindowEquations::add_all() {
  add_prior();
  for (std::size_t k = 1; k < window_.frames.size(); ++k)
    if (window_.frames[k].imu) add_imu(k);
  for (const WindowLandmark& landmark : window_.landmarks) add_landmark(landmark);
  add_images();
}

Eigen::VectorXd WindowEquations::solve() const {
  Eigen::MatrixXd damped = H_;
  damped.diagonal() *= 1.0 + damping_;
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(damped);
  if (llt.info() != Eigen::Success) return {};
  return llt.solve(-g_);
}

void WindowEquations::apply(const Eigen::VectorXd& dx, Window& target) const {
  for (const Eliminated& e : eliminated_) {
    Eigen::Vector3d step = e.step;
    if (window_.calibrates) step += dx(dx.size() - 1) * e.by_readout;
    for (std::size_t k = e.first; k < e.first + e.count; ++k)
      step.noalias() += couplings_[k].Y.transpose() * image_step(dx, couplings_[k].frame);
    target.landmarks[e.landmark].p_odom -= step;
  }
  if (target.calibrates)
    calibrate(target, target.calibration.retracted(dx.tail<kCalibrationSize>()));
  for (std::size_t k = 0; k < target.frames.size(); ++k) {
    const auto at = 15 * static_cast<Eigen::Index>(k);
    OdometryState& state = target.frames[k].state;
    state.T_odom_body = retract(state.T_odom_body, dx.segment<6>(at));
    state.v_odom += dx.segment<3>(at + 6);
    state.gyro_bias += dx.segment<3>(at + 9);
    state.accel_bias += dx.segment<3>(at + 12);
  }
}

WindowSolution optimize(Window& window, int max_iterations) {
  WindowSolution result;
  result.initial_cost = result.final_cost = window_cost(window);
  double damping = kInitialDamping;
  while (result.iterations < max_iterations && damping < kMaxDamping) {
    ++result.iterations;
    WindowEquations equations(window, damping);
    equations.add_all();
    const Eigen::VectorXd dx = equations.solve();
    const Snapshot before(window);
    if (dx.size() > 0) equations.apply(dx, window);
    const double cost = window_cost(window);
    if (dx.size() == 0 || !(cost <= result.final_cost * (1.0 + 1e-6))) {
      before.restore(window);
      damping *= 100.0;
      continue;
    }
    result.final_cost = cost;
    damping = std::max(0.1 * damping, 1e-9);
    if (dx.cwiseAbs().maxCoeff() < kSmallStep) break;
  }
  result.usable = std::isfinite(result.final_cost);
  return result;
}

void forget_frame(Window& window, std::size_t frame) {
  window.frames.erase(window.frames.begin() + static_cast<std::ptrdiff_t>(frame));
  for (WindowLandmark& landmark : window.landmarks) {
    std::erase_if(landmark.observations, [&](const auto& o) { return o.frame == frame; });
    for (WindowObservation& o : landmark.observations) o.frame -= o.frame > frame;
  }
  std::erase_if(window.landmarks, [](const auto& l) { return l.observations.empty(); });
}

void marginalize_oldest(Window& window) {
  window.frames[1].keyframe = true;  // part of the prior, so it can leave only by marginalisation
  window.prior = prior_after_oldest(window);
  for (WindowLandmark& landmark : window.landmarks) {
    if (!seen_by_oldest(landmark)) continue;
    std::erase_if(landmark.observations,  // observations in the prior must not count twice
                  [&](const auto& o) { return window.frames[o.frame].keyframe; });
    landmark.located = false;
  }
  std::erase_if(window.landmarks, [](const auto& l) { return l.observations.empty(); });
  forget_frame(window, 0);
}

}  // namespace km
