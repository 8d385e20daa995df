#include "recorded_tracking.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <map>
#include <numbers>

#include "modules/core/lie.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "modules/sensors/text_file.hpp"
#include "modules/vio/track_motion.hpp"

namespace km {
namespace {

// Trapezoidal rule over the samples of a packet, cut to the interval between the images.
Eigen::Matrix3d integrate_gyro(const std::vector<ImuSample>& imu, Stamp from, Stamp to) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  for (std::size_t i = 1; i < imu.size(); ++i) {
    const Stamp begin = std::max(imu[i - 1].stamp, from);
    const Stamp end = std::min(imu[i].stamp, to);
    if (end <= begin) continue;
    const Eigen::Vector3d rate = 0.5 * (imu[i - 1].gyro + imu[i].gyro);
    R = R * so3_exp(rate * seconds_between(begin, end));
  }
  return R;
}

std::map<std::uint64_t, const TrackedFeature*> by_id(const TrackedFrame& frame) {
  std::map<std::uint64_t, const TrackedFeature*> result;
  for (const TrackedFeature& feature : frame.features) result[feature.id] = &feature;
  return result;
}

struct View {
  SE3 T_cam_world;
  Eigen::Vector2d bearing;
};

Eigen::Vector2d view_error(const View& view, const Eigen::Vector3d& p_world) {
  return (view.T_cam_world * p_world).hnormalized() - view.bearing;
}

// Least squares on z = 1, from the linear solution.
std::optional<Eigen::Vector3d> triangulated(const std::vector<View>& views) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const View& view : views) {
    const SE3 T = view.T_cam_world.inverse();
    const Eigen::Vector3d ray = (T.linear() * view.bearing.homogeneous()).normalized();
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    A += P;
    b += P * T.translation();
  }
  Eigen::Vector3d p = A.ldlt().solve(b);
  for (int step = 0; step < 8; ++step) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const View& view : views) {
      const Eigen::Vector3d X = view.T_cam_world * p;
      if (X.z() < 0.05) return std::nullopt;
      Eigen::Matrix<double, 2, 3> J;
      J << 1 / X.z(), 0, -X.x() / (X.z() * X.z()), 0, 1 / X.z(), -X.y() / (X.z() * X.z());
      J = J * view.T_cam_world.linear();
      H += J.transpose() * J;
      g -= J.transpose() * view_error(view, p);
    }
    H.diagonal().array() *= 1.0 + 1e-9;
    p += H.ldlt().solve(g);
  }
  return p.allFinite() ? std::optional(p) : std::nullopt;
}

SE3 camera_from_world(const Recording& recording, std::size_t frame, std::size_t camera) {
  return (recording.T_world_body[frame] * recording.rig.stereo.cameras[camera].T_body_cam)
      .inverse();
}

std::vector<View> views_of(const Recording& recording, std::size_t frame,
                           const TrackedFeature& feature) {
  std::vector<View> views = {{camera_from_world(recording, frame, 0), feature.left}};
  if (feature.right) views.push_back({camera_from_world(recording, frame, 1), *feature.right});
  return views;
}

// Poses of the body from poses.txt, whose rows are 3x4 matrices of camera poses. A row belongs to
// the row of times.txt (KITTI), or begins with the number of the frame at 30 Hz (7-Scenes).
std::vector<StampedPose> read_camera_poses(const std::filesystem::path& folder,
                                           const SE3& T_cam_body) {
  const bool is_kitti = layout_of(folder) == FolderLayout::kKitti;
  const std::string text = read_file(folder / "poses.txt");
  const std::string times = is_kitti ? read_file(folder / "times.txt") : "";
  const std::vector<TextRow> stamps = split_rows(times);
  std::vector<StampedPose> poses;
  for (const TextRow& row : split_rows(text)) {
    const double t_s =
        is_kitti ? number_in(stamps.at(poses.size()), 0).value() : number_in(row, 0).value() / 30.0;
    Eigen::Matrix<double, 3, 4, Eigen::RowMajor> T;
    for (std::size_t i = 0; i < 12; ++i)
      T.data()[i] = number_in(row, i + (is_kitti ? 0 : 1)).value();
    poses.push_back(
        {nanoseconds(t_s), make_pose(nearest_rotation(T.leftCols<3>()), T.col(3)) * T_cam_body});
  }
  return poses;
}

}  // namespace

Recording read_recording(const std::filesystem::path& folder, double from_s, double to_s,
                         bool imu) {
  EurocOptions options;
  options.from_s = from_s;
  options.to_s = to_s;
  options.imu = imu;
  const auto reader = open_folder(folder, options);
  Recording result;
  result.rig = reader->rig();
  const auto truth =
      layout_of(folder) == FolderLayout::kEuroc
          ? read_trajectory(folder / "mav0/state_groundtruth_estimate0")
          : read_camera_poses(folder, result.rig.stereo.cameras[0].T_body_cam.inverse());
  const Eigen::Matrix4d unknown =
      Eigen::Matrix4d::Constant(std::numeric_limits<double>::quiet_NaN());
  while (auto packet = reader->next()) {
    result.T_world_body.push_back(
        pose_at(truth, packet->frame->stamp, 0.1, 0.0).value_or(SE3(unknown)));
    result.packets.push_back(std::move(*packet));
  }
  return result;
}

TrackingRun run_tracker(const Recording& recording, const TrackerConfig& config) {
  FeatureTracker tracker(recording.rig.stereo, config);
  TrackingRun run;
  for (std::size_t i = 0; i < recording.packets.size(); ++i) {
    const SensorPacket& packet = recording.packets[i];
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    if (i > 0)
      R = integrate_gyro(packet.imu, recording.packets[i - 1].frame->stamp, packet.frame->stamp);
    const std::clock_t start = std::clock();  // Processor time: the processor is shared.
    run.frames.push_back(tracker.track(*packet.frame, R));
    run.milliseconds.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    run.statistics.push_back(tracker.statistics());
  }
  return run;
}

ErrorSummary summarize(std::vector<double> errors_px) {
  ErrorSummary result;
  result.count = errors_px.size();
  if (errors_px.empty()) return result;
  std::sort(errors_px.begin(), errors_px.end());
  result.median_px = errors_px[errors_px.size() / 2];
  result.p90_px = errors_px[errors_px.size() * 9 / 10];
  constexpr double kOutlierPx = 3.0;
  const auto outliers =
      errors_px.end() - std::upper_bound(errors_px.begin(), errors_px.end(), kOutlierPx);
  result.outlier_share = static_cast<double>(outliers) / static_cast<double>(errors_px.size());
  return result;
}

ReprojectionErrors reprojection_errors(const Recording& recording, const TrackingRun& run,
                                       std::size_t gap) {
  const double f = recording.rig.stereo.cameras[0].fx;
  std::mt19937 rng(1);
  std::vector<double> left;
  std::vector<double> right;
  std::vector<double> fitted;
  std::vector<double> fit_translation;
  std::vector<double> fit_rotation;
  for (std::size_t i = 0; i + gap < run.frames.size(); ++i) {
    const auto later = by_id(run.frames[i + gap]);
    std::vector<DepthPair> pairs;
    for (const TrackedFeature& feature : run.frames[i].features) {
      const auto found = later.find(feature.id);
      if (!feature.right || found == later.end()) continue;
      const auto p_world = triangulated(views_of(recording, i, feature));
      if (!p_world) continue;
      const auto views = views_of(recording, i + gap, *found->second);
      left.push_back(f * view_error(views[0], *p_world).norm());
      if (views.size() > 1) right.push_back(f * view_error(views[1], *p_world).norm());
      const double depth = (camera_from_world(recording, i, 0) * *p_world).z();
      pairs.push_back({feature.left, 1.0 / depth, found->second->left});
    }
    const SE3 truth =
        camera_from_world(recording, i, 0) * camera_from_world(recording, i + gap, 0).inverse();
    const auto fit = estimate_motion(pairs, truth, 1.0 / f, rng);
    if (!fit) continue;
    for (const DepthPair& pair : pairs) fitted.push_back(f * reprojection_distance(pair, *fit));
    const SE3 error = truth.inverse() * *fit;
    fit_translation.push_back(1e3 * error.translation().norm());
    fit_rotation.push_back(kDegrees * angle_of(error.linear()));
  }
  return {summarize(std::move(left)), summarize(std::move(right)), summarize(std::move(fitted)),
          summarize(std::move(fit_translation)).median_px,
          summarize(std::move(fit_rotation)).median_px};
}

ErrorSummary epipolar_errors(const Recording& recording, const TrackingRun& run) {
  const SE3 T_left_right = recording.rig.stereo.T_left_right();
  const double f = recording.rig.stereo.cameras[0].fx;
  std::vector<double> errors;
  for (const TrackedFrame& frame : run.frames) {
    for (const TrackedFeature& feature : frame.features) {
      if (!feature.right) continue;
      errors.push_back(f * epipolar_distance({feature.left, *feature.right}, T_left_right.linear(),
                                             T_left_right.translation()));
    }
  }
  return summarize(std::move(errors));
}

double survival(const TrackingRun& run, std::size_t gap) {
  double sum = 0.0;
  std::size_t images = 0;
  for (std::size_t i = 0; i + gap < run.frames.size(); ++i) {
    if (run.frames[i].features.empty()) continue;
    const auto later = by_id(run.frames[i + gap]);
    std::size_t alive = 0;
    for (const TrackedFeature& feature : run.frames[i].features) alive += later.count(feature.id);
    sum += static_cast<double>(alive) / static_cast<double>(run.frames[i].features.size());
    ++images;
  }
  return images > 0 ? sum / static_cast<double>(images) : 0.0;
}

}  // namespace km
