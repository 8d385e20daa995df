#include "recorded_odometry.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "modules/core/camera/depth_lookup.hpp"
#include "modules/dense_sensing/stereo_depth.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/support/euroc_copy.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

// Poses of the body by the truth in `folder`; none if there is no truth.
std::vector<StampedPose> read_truth(const std::filesystem::path& folder, const SensorRig& rig) {
  const FolderLayout layout = layout_of(folder);
  if (layout == FolderLayout::kEuroc) {
    const auto states = folder / "mav0/state_groundtruth_estimate0";
    return std::filesystem::exists(states) ? read_trajectory(states) : std::vector<StampedPose>{};
  }
  std::vector<StampedPose> poses =
      read_trajectory(folder / (layout == FolderLayout::kTum ? "groundtruth.txt" : "poses.txt"));
  for (StampedPose& pose : poses) pose.T = pose.T * rig.stereo.cameras[0].T_body_cam.inverse();
  return poses;
}

// The pixel at which a rectified camera sees the ray of a pixel of the left camera, and the ratio
// of the depths along their axes.
struct SeenRay {
  Eigen::Vector2d rectified_px;
  double depth_ratio = 0.0;
};

// Rays of all pixels of the left camera; nullopt if its lens has no bearing there.
std::vector<std::optional<SeenRay>> seen_rays(const Camera& rectified, const Camera& left) {
  const SE3 T_rect_left = rectified.T_body_cam.inverse() * left.T_body_cam;
  std::vector<std::optional<SeenRay>> rays;
  for (int y = 0; y < left.height; ++y)
    for (int x = 0; x < left.width; ++x) {
      const auto bearing = left.unproject(Eigen::Vector2d(x, y));
      auto& seen = rays.emplace_back();
      if (!bearing) continue;
      const Eigen::Vector3d ray = T_rect_left.linear() * bearing->homogeneous();
      if (const auto px = rectified.project_ray(ray)) seen = SeenRay{*px, ray.z()};
    }
  return rays;
}

// Repeats `packets` until there are `count` of them. The samples before the second image are also
// used before each first one.
void repeat(std::vector<SensorPacket>& packets, std::size_t count) {
  const std::size_t turn = packets.size();
  const Stamp step = packets[1].frame->stamp - packets[0].frame->stamp;
  const Stamp period = packets.back().frame->stamp - packets.front().frame->stamp + step;
  while (packets.size() < count) {
    const std::size_t k = packets.size();
    const Stamp shift = period * static_cast<Stamp>(k / turn);
    auto frame = std::make_shared<StereoFrame>(*packets[k % turn].frame);
    frame->stamp += shift;
    SensorPacket packet = packets[std::max<std::size_t>(k % turn, 1)];
    for (ImuSample& sample : packet.imu) sample.stamp += shift - (k % turn == 0 ? step : 0);
    packet.frame = std::move(frame);
    packets.push_back(std::move(packet));
  }
}

// The factor that best scales an estimate to the truth.
double scale_of(std::span<const PosePair> pairs) {
  Eigen::Matrix3Xd estimate(3, pairs.size()), truth(3, pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    estimate.col(static_cast<Eigen::Index>(i)) = pairs[i].T_estimate_body.translation();
    truth.col(static_cast<Eigen::Index>(i)) = pairs[i].T_truth_body.translation();
  }
  return Eigen::umeyama(estimate, truth, true).col(0).head<3>().norm();
}

}  // namespace

Recording read_recording(const std::filesystem::path& folder, double from_s, double to_s,
                         bool imu) {
  FolderOptions options;
  options.part.from_s = from_s;
  options.part.to_s = to_s;
  options.imu = imu;
  const bool is_tum = layout_of(folder) == FolderLayout::kTum;
  FolderReader reader = open_folder(folder, options, is_tum ? folder / "rig.yaml" : "");
  Recording result;
  result.rig = reader.rig();
  const std::vector<StampedPose> truth = read_truth(folder, result.rig);
  const Eigen::Matrix4d unknown =
      Eigen::Matrix4d::Constant(std::numeric_limits<double>::quiet_NaN());
  while (auto packet = reader.next()) {
    result.T_world_body.push_back(
        pose_at(truth, packet->frame->stamp, 0.1, 0.0).value_or(SE3(unknown)));
    result.packets.push_back(std::move(*packet));
  }
  return result;
}

OdometryRun run_odometry(const Recording& recording, std::size_t first, std::size_t last,
                         const TrackerConfig& tracker, const VioConfig& config,
                         const std::optional<VioCheckpoint>& checkpoint) {
  Vio vio(0, recording.rig, tracker, config);
  if (checkpoint) vio.continue_from(*checkpoint);
  OdometryRun run;
  std::map<Stamp, const SE3*> truth;
  for (std::size_t k = first; k < last; ++k) {
    truth[recording.packets[k].frame->stamp] = &recording.T_world_body[k];
    VioResult result = vio.process(recording.packets[k]);
    for (const OdometryState& state : result.states) {
      run.states.push_back(state);
      run.truth.push_back(*truth.at(state.stamp));
    }
    run.keyframes.insert(run.keyframes.end(), result.keyframes.begin(), result.keyframes.end());
    run.results.push_back(std::move(result));
  }
  run.statistics = vio.statistics();
  return run;
}

OdometryErrors odometry_errors(std::span<const OdometryState> states, std::span<const SE3> truth) {
  std::vector<StampedPose> estimated, true_poses;
  std::vector<PosePair> pairs;
  double tilt = 0.0;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const Stamp stamp = states[k].stamp;
    const SE3& T = states[k].T_odom_body;
    if (truth[k].matrix().hasNaN()) continue;
    estimated.push_back({stamp, T});
    true_poses.push_back({stamp, truth[k]});
    pairs.push_back({stamp, truth[k], T});
    const double cosine = T.linear().row(2).dot(truth[k].linear().row(2));
    tilt += std::pow(std::acos(std::clamp(cosine, -1.0, 1.0)), 2);
  }
  const TrajectoryInput input{"", true_poses, estimated, std::nullopt};
  const TrajectoryError error = trajectory_error({&input, 1}).joint;
  return {
      .ate_m = error.position_m.rmse,
      .rpe_m = error.rpe_translation_m.rmse,
      .rpe_deg = error.rpe_rotation_deg.rmse,
      .tilt_deg = 180.0 / std::numbers::pi * std::sqrt(tilt / static_cast<double>(pairs.size())),
      .scale = scale_of(pairs)};
}

Recording standing_recording(const std::filesystem::path& folder, double duration_s) {
  const TemporaryFolder links;
  link_static_start(folder, links.path());
  FolderReader reader = open_folder(links.path());
  Recording result;
  result.rig = reader.rig();
  while (auto packet = reader.next()) result.packets.push_back(std::move(*packet));
  repeat(result.packets, static_cast<std::size_t>(std::lround(5.0 * duration_s)) + 1);
  result.T_world_body.assign(result.packets.size(), SE3::Identity());
  return result;
}

Recording delayed(const Recording& recording, double late_s) {
  Recording result = recording;
  std::vector<ImuSample> samples;
  for (const SensorPacket& packet : recording.packets)
    for (const ImuSample& sample : packet.imu)
      if (samples.empty() || sample.stamp > samples.back().stamp) samples.push_back(sample);
  for (ImuSample& sample : samples) sample.stamp += static_cast<Stamp>(std::llround(1e9 * late_s));
  std::size_t next = 0;
  for (SensorPacket& packet : result.packets) {
    packet.imu.clear();
    if (next > 0) --next;  // border sample of two packets
    while (next < samples.size() &&
           (packet.imu.empty() || packet.imu.back().stamp < packet.frame->stamp))
      packet.imu.push_back(samples[next++]);
  }
  return result;
}

Recording darkened(Recording recording, std::size_t first, std::size_t last) {
  for (std::size_t k = first; k < last; ++k) {
    auto frame = std::make_shared<StereoFrame>(*recording.packets[k].frame);
    std::fill(frame->left.pixels.begin(), frame->left.pixels.end(), std::uint8_t{0});
    std::fill(frame->right.pixels.begin(), frame->right.pixels.end(), std::uint8_t{0});
    recording.packets[k].frame = frame;
  }
  return recording;
}

Recording as_rgbd(const Recording& recording) {
  const StereoRig& rig = recording.rig.stereo;
  constexpr double kMaxDepth_m = 60.0;  // below the range of 16 bits of millimetres
  StereoDepth stereo(rig, {.min_depth_m = 0.4, .max_depth_m = kMaxDepth_m});
  const auto rays = seen_rays(stereo.camera(), rig.cameras[0]);
  const auto through_lens = [&](const DepthImage& depth) {
    DepthImage result{rig.cameras[0].width, rig.cameras[0].height, {}};
    for (const auto& ray : rays) {
      const auto inverse_depth =
          ray ? inverse_depth_at(depth, ray->rectified_px, depth_edge_threshold(rig))
              : std::nullopt;
      result.millimetres.push_back(inverse_depth ? static_cast<std::uint16_t>(std::lround(
                                                       1e3 / (*inverse_depth * ray->depth_ratio)))
                                                 : std::uint16_t{0});
    }
    return result;
  };
  Recording rgbd = recording;
  rgbd.rig.stereo = rgbd_rig(rig.cameras[0], rig.baseline_m());
  rgbd.rig.depth = DepthRange{};
  for (SensorPacket& packet : rgbd.packets) {
    const StereoFrame& pair = *packet.frame;
    StereoFrame frame{pair.stamp, pair.left, {}};
    frame.depth =
        std::make_shared<const DepthImage>(through_lens(stereo.compute(pair.left, pair.right)));
    packet.frame = std::make_shared<const StereoFrame>(std::move(frame));
  }
  return rgbd;
}

}  // namespace km
