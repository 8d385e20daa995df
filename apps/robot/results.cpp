#include "apps/robot/results.hpp"

#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "modules/core/json_writer.hpp"
#include "modules/pose_graph/g2o_io.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

std::ofstream open(const fs::path& file) {
  std::ofstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
  return stream;
}

void close(std::ofstream& stream, const fs::path& file) {
  stream.close();
  if (!stream) throw std::runtime_error(file.string() + ": writing failed, is the disk full?");
}

const char* to_string(ClosureStage stage) {
  switch (stage) {
    case ClosureStage::kCandidate:
      return "candidate";
    case ClosureStage::kRequested:
      return "requested";
    case ClosureStage::kReceived:
      return "received";
    case ClosureStage::kVerified:
      return "verified";
    case ClosureStage::kInlier:
      return "inlier";
  }
  return "";
}

void write_keyframes(const fs::path& file, const RunRecord& record) {
  std::ofstream out = open(file);
  out << "robot,keyframe,stamp_ns,median_depth_m\n";
  for (const KeyframeOdometry& keyframe : record.keyframes())
    out << keyframe.id.robot << ',' << keyframe.id.index << ',' << keyframe.stamp << ','
        << record.median_depth_m(keyframe.id.index) << '\n';
  close(out, file);
}

// tx,ty,tz,qx,qy,qz,qw of the pose of `to` in the frame of `from`, all empty if it was not
// measured.
std::string pose_fields(const RunRecord& record, const ClosureOutcome& outcome) {
  const auto closure = record.closures().find(outcome.id);
  if (outcome.stage < ClosureStage::kVerified || closure == record.closures().end())
    return ",,,,,,";
  const Closure& measured = closure->second;
  const bool same_way = measured.from.id == outcome.id.from;
  const SE3 T_from_to = same_way ? measured.T_from_to : measured.T_from_to.inverse();
  const Eigen::Vector3d& t = T_from_to.translation();
  const Eigen::Quaterniond q(T_from_to.linear());
  char text[192];
  std::snprintf(text, sizeof text, "%.6f,%.6f,%.6f,%.8f,%.8f,%.8f,%.8f", t.x(), t.y(), t.z(), q.x(),
                q.y(), q.z(), q.w());
  return text;
}

void write_closures(const fs::path& file, const RunRecord& record) {
  std::ofstream out = open(file);
  out << "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,"
         "tx,ty,tz,qx,qy,qz,qw,reason\n";
  for (const ClosureOutcome& row : record.outcomes())
    out << row.id.from.robot << ',' << row.id.from.index << ',' << row.id.to.robot << ','
        << row.id.to.index << ',' << row.similarity << ',' << to_string(row.stage) << ','
        << row.matches << ',' << row.inliers << ',' << pose_fields(record, row) << ",\""
        << row.reason << "\"\n";
  close(out, file);
}

// The robot's own poses with every edge that touches them: odometry, and the inlier closures of
// either finder; and the verticals. Poses of other robots stay in their files.
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
                             keyframes[i].covariance});
  }
  for (const Closure& closure : record.inlier_closures())
    graph.edges.push_back(closure.relative_pose());
  return graph;
}

void write_rounds(const fs::path& file, const RunRecord& record) {
  std::ofstream out = open(file);
  out << "seconds,round,members,cost,gradient_norm\n";
  for (const RunRecord::OptimizerRound& row : record.rounds())
    out << row.seconds << ',' << row.round << ',' << row.members << ',' << row.cost << ','
        << row.gradient_norm << '\n';
  close(out, file);
}

// Frames that went into the map, and why others did not.
void write_map_counts(JsonWriter& json, const RunRecord& record) {
  const MappingProgress map = record.mapping().value_or(MappingProgress{});
  const DenseSensingProgress sensing = record.dense_sensing().value_or(DenseSensingProgress{});
  json.key("mapping");
  json.begin_object();
  json.field("frames", map.integrated);
  json.field("skipped_wrong_size", sensing.wrong_size + map.wrong_size);
  json.field("skipped_bad_pose", map.bad_pose);
  json.field("skipped_too_late", map.too_late);
  json.field("without_labels", map.unlabelled);
  json.field("label_pixels_outside_palette", map.labels_outside + sensing.classes_outside);
  json.field("blocks_refused", map.blocks_refused);
  json.field("blocks", map.size.blocks);
  json.field("vertices", map.size.vertices);
  json.field("faces", map.size.faces);
  json.field("superseded_faces_dropped", map.size.dropped_faces);
  const RunRecord::MeshCorrections& corrections = record.mesh_corrections();
  json.field("corrections", corrections.deformed);
  json.field("moves_as_a_whole", corrections.moved);
  json.field("correction_seconds", corrections.seconds);
  json.field("unbound_vertices", corrections.last.unbound_vertices);
  json.end_object();
}

void write_process(JsonWriter& json, const ProcessUsage& usage, const MemoryTrend& memory) {
  json.key("process");
  json.begin_object();
  json.field("cpu_s", usage.cpu_s);
  json.field("peak_memory_bytes", usage.peak_bytes);
  json.field("memory_at_start_bytes", memory.first_bytes);
  json.field("memory_at_end_bytes", memory.last_bytes);
  if (memory.growth_bytes_per_minute)
    json.field("memory_growth_bytes_per_minute", *memory.growth_bytes_per_minute);
  json.end_object();
}

void write_summary(const fs::path& file, const RunRecord& record, const RunSummary& summary) {
  RunRecord::StageCounts total;
  for (const auto& [peer, counts] : record.stages_per_peer()) {
    total.candidates += counts.candidates;
    total.verified += counts.verified;
    total.inliers += counts.inliers;
  }
  const OptimizerProgress& progress = record.progress();
  std::ofstream out = open(file);
  JsonWriter json(out);
  json.begin_object();
  json.field("robot", record.robot());
  json.field("name", summary.name);
  json.field("keyframes", record.keyframes().size());
  json.field("keypoints", record.keypoints());
  json.field("frames", summary.frames);
  json.field("frames_skipped", summary.frames_skipped);
  json.key("closures");
  json.begin_object();
  json.field("candidates", total.candidates);
  json.field("verified", total.verified);
  json.field("inliers", total.inliers);
  json.end_object();
  json.key("pgo");
  json.begin_object();
  json.field("rounds", progress.round);
  json.field("seconds", progress.seconds);
  json.field("cost", progress.cost);
  json.field("gradient_norm", progress.gradient_norm);
  json.field("anchor", progress.anchor);
  json.field("settled", progress.settled);
  json.array("members", progress.members);
  json.end_object();
  if (record.dense_sensing()) write_map_counts(json, record);
  json.key("traffic");
  json.begin_object();
  for (const auto& [category, bytes] : summary.traffic_bytes) json.field(category, bytes);
  json.end_object();
  write_process(json, summary.process, summary.memory);
  json.field("seconds", summary.seconds);
  json.field("exit_reason", summary.exit_reason);
  json.end_object();
  close(out, file);
}

}  // namespace

void write_tum(const fs::path& file, std::span<const StampedPose> poses) {
  std::ofstream out = open(file);
  for (const StampedPose& pose : poses) {
    const Eigen::Vector3d& t = pose.T.translation();
    const Eigen::Quaterniond q(pose.T.linear());
    char line[256];
    // Whole and fractional seconds apart: a double holds epoch nanoseconds to 0.2 us only.
    std::snprintf(line, sizeof line,
                  "%" PRId64 ".%09" PRId64 " %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                  pose.stamp / 1'000'000'000, pose.stamp % 1'000'000'000, t.x(), t.y(), t.z(),
                  q.x(), q.y(), q.z(), q.w());
    out << line;
  }
  close(out, file);
}

void write_results(const fs::path& folder, const RunRecord& record, const RunSummary& summary) {
  write_tum(folder / "odometry.tum", record.odometry());
  write_tum(folder / "optimized.tum", record.optimized());
  write_g2o(folder / "pose_graph.g2o", graph_of(record));
  write_keyframes(folder / "keyframes.csv", record);
  write_closures(folder / "loop_closures.csv", record);
  write_rounds(folder / "optimizer.csv", record);
  write_summary(folder / "summary.json", record, summary);
}

}  // namespace km
