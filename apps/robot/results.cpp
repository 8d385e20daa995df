#include "apps/robot/results.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>

#include "apps/output_file.hpp"
#include "apps/result_files.hpp"
#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/recorded_graph/g2o_io.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// By ClosureStage.
constexpr std::array kStageNames = {"candidate", "requested", "received", "verified", "inlier"};

void write_keyframes(std::ostream& out, const RunRecord& record) {
  out << "robot,keyframe,stamp_ns,median_depth_m\n";
  for (const RunRecord::RecordedKeyframe& keyframe : record.keyframes())
    out << keyframe.id.robot << ',' << keyframe.id.index << ',' << keyframe.stamp << ','
        << record.median_depth_m(keyframe.id.index) << '\n';
}

// The pose of `to` in the frame of `from`; nullopt without a measurement.
std::optional<UncertainPose> measured_pose(const RunRecord& record, const ClosureOutcome& outcome) {
  const auto closure = record.closures().find(outcome.id);
  if (outcome.stage < ClosureStage::kVerified || closure == record.closures().end())
    return std::nullopt;
  const UncertainPose measured{closure->second.T_from_to, closure->second.covariance};
  return closure->second.from == outcome.id.from ? measured : inverse(measured);
}

ClosureStatus status_of(const ClosureOutcome& outcome) {
  if (outcome.stage == ClosureStage::kInlier) return ClosureStatus::kKept;
  if (outcome.stage < ClosureStage::kVerified) return ClosureStatus::kCandidate;
  return outcome.reason.empty() ? ClosureStatus::kVerified : ClosureStatus::kRejected;
}

// tx,ty,tz,qx,qy,qz,qw and six standard deviations, all empty without a pose.
std::string pose_fields(const std::optional<UncertainPose>& T_from_to) {
  if (!T_from_to) return ",,,,,,,,,,,,";
  const Eigen::Vector3d t = T_from_to->T.translation();
  const Eigen::Quaterniond q(T_from_to->T.linear());
  const Vector6 sigma = T_from_to->Sigma.diagonal().cwiseAbs().cwiseSqrt();
  char text[320];
  std::snprintf(text, sizeof text,
                "%.6f,%.6f,%.6f,%.8f,%.8f,%.8f,%.8f,%.3g,%.3g,%.3g,%.3g,%.3g,%.3g", t.x(), t.y(),
                t.z(), q.x(), q.y(), q.z(), q.w(), sigma[0], sigma[1], sigma[2], sigma[3], sigma[4],
                sigma[5]);
  return text;
}

void write_closures(std::ostream& out, const RunRecord& record) {
  out << "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,"
         "tx,ty,tz,qx,qy,qz,qw,sigma_rx,sigma_ry,sigma_rz,sigma_tx,sigma_ty,sigma_tz,reason\n";
  for (const ClosureOutcome& row : record.outcomes())
    out << row.id.from.robot << ',' << row.id.from.index << ',' << row.id.to.robot << ','
        << row.id.to.index << ',' << row.similarity << ','
        << kStageNames.at(static_cast<std::size_t>(row.stage)) << ',' << row.matches << ','
        << row.inliers << ',' << pose_fields(measured_pose(record, row)) << ",\"" << row.reason
        << "\"\n";
}

// The covariance of a step of odometry, scaled by the noise that the optimiser used.
Matrix6 judged_covariance(const Matrix6& claimed, const OptimizerProgress& progress) {
  Vector6 scale;
  scale.head<3>().setConstant(progress.odometry_rotation_noise);
  scale.tail<3>().setConstant(progress.odometry_translation_noise);
  return scale.asDiagonal() * claimed * scale.asDiagonal();
}

// The robot's own poses, their verticals, and every edge that touches them: odometry, and the
// inlier closures found by either robot. Poses of other robots stay in their files.
G2oGraph graph_of(const RunRecord& record) {
  G2oGraph graph;
  const auto& keyframes = record.keyframes();
  const auto& trajectory = record.trajectory();
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const bool solved = trajectory && i < trajectory->T_world_kf.size();
    const SE3& T = solved ? trajectory->T_world_kf[i] : keyframes[i].T_odom_kf;
    graph.vertices.push_back({keyframes[i].id, T});
    if (keyframes[i].vertical) graph.verticals.push_back({keyframes[i].id, *keyframes[i].vertical});
    if (i > 0)
      graph.edges.push_back({keyframes[i - 1].id, keyframes[i].id, keyframes[i].T_previous_kf,
                             judged_covariance(keyframes[i].covariance, record.progress())});
  }
  for (RelativePose& closure : record.inlier_closures()) graph.edges.push_back(std::move(closure));
  return graph;
}

MappingSummary map_counts(const RunRecord& record) {
  const MappingProgress map = record.mapping().value_or(MappingProgress{});
  const DenseSensingProgress sensing = record.dense_sensing().value_or(DenseSensingProgress{});
  const RunRecord::MeshCorrections& corrections = record.mesh_corrections();
  return {.frames = map.integrated,
          .dropped_under_load = sensing.dropped_under_load,
          .skipped_wrong_size = sensing.wrong_size + map.wrong_size,
          .skipped_bad_pose = map.bad_pose,
          .skipped_too_late = map.too_late,
          .without_labels = map.unlabelled,
          .label_pixels_outside_palette = map.off_palette_pixels + sensing.unmapped_pixels,
          .blocks_refused = map.blocks_refused,
          .blocks = map.size.blocks,
          .vertices = map.size.vertices,
          .faces = map.size.faces,
          .superseded_faces_dropped = map.size.dropped_faces,
          .corrections = corrections.count,
          .correction_seconds = corrections.seconds,
          .unbound_vertices = corrections.last.unbound_vertices};
}

CamerasSummary cameras_of(const UncertainCalibration& known) {
  const auto sigma = [](const Eigen::Matrix3d& covariance) {
    return std::sqrt(covariance.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff());
  };
  const SE3& T = known.calibration.T_body_rig;
  const Eigen::Vector3d rotation = so3_log(T.linear());
  return {.offset_s = known.calibration.offset_s,
          .offset_sigma_s = std::sqrt(known.covariance(0, 0)),
          .rotation_x_rad = rotation.x(),
          .rotation_y_rad = rotation.y(),
          .rotation_z_rad = rotation.z(),
          .rotation_sigma_rad = sigma(known.covariance.block<3, 3>(1, 1)),
          .translation_x_m = T.translation().x(),
          .translation_y_m = T.translation().y(),
          .translation_z_m = T.translation().z(),
          .translation_sigma_m = sigma(known.covariance.block<3, 3>(4, 4)),
          .readout_s = known.calibration.readout_s,
          .readout_sigma_s = std::sqrt(known.covariance(7, 7))};
}

std::optional<HolesSummary> holes_of(const std::vector<StampedPose>& path) {
  HolesSummary summary;
  for (const PoseHole& hole : pose_holes(path)) {
    const double hole_s = seconds_between(hole.from, hole.to);
    ++summary.count;
    summary.seconds += hole_s;
    if (hole_s <= summary.longest_s) continue;
    summary.longest_s = hole_s;
    summary.longest_from_s = seconds_between(path.front().stamp, hole.from);
  }
  return summary.count == 0 ? std::nullopt : std::optional(summary);
}

// TUM: "time[s] tx ty tz qx qy qz qw", nine decimals of seconds.
void write_pose(std::ostream& out, const StampedPose& pose) {
  const Eigen::Vector3d& t = pose.T.translation();
  const Eigen::Quaterniond q(pose.T.linear());
  char line[256];
  // Whole and fractional seconds are separate, because a double holds epoch nanoseconds only to
  // 0.2 us.
  std::snprintf(line, sizeof line, "%" PRId64 ".%09" PRId64 " %.9f %.9f %.9f %.9f %.9f %.9f %.9f",
                pose.stamp / 1'000'000'000, pose.stamp % 1'000'000'000, t.x(), t.y(), t.z(), q.x(),
                q.y(), q.z(), q.w());
  out << line;
}

void write_poses(std::ostream& out, const std::vector<StampedPose>& poses) {
  for (const StampedPose& pose : poses) {
    write_pose(out, pose);
    out << '\n';
  }
}

// Writes the optimised keyframes, each with the 36 numbers of its covariance if it is known.
void write_keyframe_poses(std::ostream& out, const RunRecord& record) {
  const std::vector<StampedPose> poses = record.optimized_keyframes();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    write_pose(out, poses[k]);
    const Trajectory& solved = *record.trajectory();
    if (k < solved.covariances.size()) {
      const Matrix6 Sigma = along_fixed_axes(
          with_scale_error({poses[k].T, solved.covariances[k]}, solved.scale_sigma));
      for (const double x : Sigma.reshaped()) out << ' ' << rounded(x, 9);
    }
    out << '\n';
  }
}

}  // namespace

void write_results(const fs::path& folder, const RunRecord& record, ResultWriter& results) {
  const auto write = [&](const char* name, const auto& write_rows, const auto& rows) {
    results.write(folder / name, [&](const fs::path& file) {
      write_output(file, [&](std::ostream& out) { write_rows(out, rows); });
    });
  };
  write("odometry.tum", write_poses, record.odometry());
  write("live.tum", write_poses, record.live());
  write("optimized.tum", write_poses, record.optimized());
  write("optimized_keyframes.tum", write_keyframe_poses, record);
  results.write(folder / "pose_graph.g2o",
                [&](const fs::path& file) { write_g2o(file, graph_of(record)); });
  write("keyframes.csv", write_keyframes, record);
  write("loop_closures.csv", write_closures, record);
}

std::optional<CorrectionSummary> correction_of(const RunRecord& record) {
  const std::vector<StampedPose> optimized = record.optimized_keyframes();
  if (optimized.size() < 2) return std::nullopt;
  CorrectionSummary summary;
  std::vector<double> squares;
  UncertainPose odometry;
  for (std::size_t i = 1; i < optimized.size(); ++i) {
    const RunRecord::RecordedKeyframe& keyframe = record.keyframes()[i];
    odometry = compose(odometry, {keyframe.T_previous_kf, keyframe.covariance});
    const Vector6 e = local_coordinates(odometry.T, optimized[0].T.inverse() * optimized[i].T);
    squares.push_back(e.dot(odometry.Sigma.ldlt().solve(e)) / 6.0);
    summary.largest_m = std::max(summary.largest_m, e.tail<3>().norm());
  }
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::ranges::nth_element(squares, middle);
  summary.normalised_square = *middle;
  return summary;
}

std::vector<PublishedClosure> published_closures(const RunRecord& record) {
  std::vector<PublishedClosure> published;
  for (const ClosureOutcome& outcome : record.outcomes()) {
    const auto measured = measured_pose(record, outcome);
    published.push_back({.id = outcome.id,
                         .status = status_of(outcome),
                         .T_from_to = measured ? std::optional(measured->T) : std::nullopt});
  }
  return published;
}

RunSummary summary_of(const RunRecord& record) {
  RunSummary summary;
  summary.robot = record.robot();
  summary.keyframes = record.keyframes().size();
  summary.keypoints = record.keypoints();
  summary.peer_keyframes = record.peer_keyframes();
  for (const auto& [peer, counts] : record.closure_tallies()) {
    summary.closures.candidates += counts.candidates;
    summary.closures.verified += counts.verified;
    summary.closures.inliers += counts.inliers;
  }
  summary.pgo = record.progress();
  summary.odometry = record.odometry_statistics();
  summary.holes = holes_of(record.odometry());
  summary.correction = correction_of(record);
  if (record.calibration()) summary.cameras = cameras_of(*record.calibration());
  if (record.dense_sensing()) summary.mapping = map_counts(record);
  return summary;
}

}  // namespace km
