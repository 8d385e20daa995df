#include "apps/team/team_report.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "modules/core/io/text_table.hpp"
#include "modules/evaluation/mesh/mesh_report.hpp"

namespace km {
namespace {

using Rows = std::vector<std::vector<std::string>>;

constexpr const char* kMapTraffic = "map";
constexpr std::array kTraffic = {"place_recognition", "geometric_verification", "pgo", kMapTraffic,
                                 "other"};

// Absolute error, drift and covered share of the recording; "-" for missing values.
std::vector<std::string> error_cells(const TrajectoryError* error) {
  if (error == nullptr) return {"-", "-", "-", "-"};
  const auto mean = [](const Statistics& statistics, int decimals) {
    return statistics.count > 0 ? fixed(statistics.mean, decimals) : "-";
  };
  return {fixed(error->position_m.rmse, 4), mean(error->drift_percent, 2),
          mean(error->drift_deg_per_m, 3), fixed(100.0 * error->completeness, 1) + '%'};
}

void append(std::vector<std::string>& row, const std::vector<std::string>& cells) {
  row.insert(row.end(), cells.begin(), cells.end());
}

// The robot's part of a report on trajectories or meshes.
const auto* find(const auto& report, const std::string& name) {
  const typename decltype(report->robots)::value_type* found = nullptr;
  if (report)
    for (const auto& error : report->robots)
      if (error.name == name) found = &error;
  return found;
}

std::string end_of(const RobotResult& robot) {
  if (!robot.run.exit.ok()) return "FAILED, " + to_string(robot.run.exit);
  return robot.summary && !robot.summary->exit_reason.empty() ? robot.summary->exit_reason : "ok";
}

std::string run_table(const TeamResult& team) {
  Rows rows = {{"robot", "frames", "skipped", "keyframes", "end"}};
  for (const RobotResult& robot : team.robots) {
    const RunSummary summary = robot.summary.value_or(RunSummary{});
    rows.push_back({robot.plan.name, std::to_string(summary.frames),
                    std::to_string(summary.frames_skipped), std::to_string(summary.keyframes),
                    end_of(robot)});
  }
  return align_columns(rows);
}

// "Drift: mean over pieces of 1, 2 and 5 m of the path."
std::string drift_remark(const TeamResult& team) {
  std::set<double> lengths_m;
  const auto add = [&](const TrajectoryError& error) {
    lengths_m.insert(error.segment_lengths_m.begin(), error.segment_lengths_m.end());
  };
  for (const RobotResult& robot : team.robots)
    if (robot.odometry) add(*robot.odometry);
  if (team.optimized) add(team.optimized->joint);
  if (lengths_m.empty()) return "";
  std::ostringstream lengths;
  std::size_t left = lengths_m.size();
  for (const double length_m : lengths_m)
    lengths << length_m << (--left == 0 ? " m" : left == 1 ? " and " : ", ");
  return R"(ATE: root mean square error. Drift: mean relative error over pieces of the path of )" +
         lengths.str() + R"(, in percent of
their length and in degrees per metre. Covered: share of the time of the images that has poses. Odometry is
aligned with the truth robot by robot, and optimised trajectories by one transform for the team. Live: poses
as they were known when each image came, in the team's frame, from the time at which the robot joined.
)";
}

std::string trajectory_table(const TeamResult& team) {
  Rows rows = {{"robot", "odometry ATE [m]", "drift [%]", "[deg/m]", "covered", "optimized ATE [m]",
                "drift [%]", "[deg/m]", "covered"}};
  for (const RobotResult& robot : team.robots) {
    rows.push_back({robot.plan.name});
    append(rows.back(), error_cells(robot.odometry ? &*robot.odometry : nullptr));
    append(rows.back(), error_cells(find(team.optimized, robot.plan.name)));
  }
  rows.push_back({"team, one frame", "", "", "", ""});
  append(rows.back(), error_cells(team.optimized ? &team.optimized->joint : nullptr));
  rows.push_back({"live, one frame", "", "", "", ""});
  append(rows.back(), error_cells(team.live ? &team.live->joint : nullptr));
  return align_columns(rows) + drift_remark(team);
}

std::string closure_table(const TeamResult& team) {
  Rows rows = {{"robot", "candidates", "verified", "inliers", "PGO rounds", "PGO time [s]",
                "PGO cost", "anchor", "solves with"}};
  const auto add = [&](const std::string& name, const RunSummary& summary) {
    const ClosureCounts& closures = summary.closures;
    rows.push_back({name, std::to_string(closures.candidates), std::to_string(closures.verified),
                    std::to_string(closures.inliers), std::to_string(summary.pgo.round),
                    fixed(summary.pgo.seconds, 2)});
  };
  RunSummary sum;
  for (const RobotResult& robot : team.robots) {
    const RunSummary summary = robot.summary.value_or(RunSummary{});
    const OptimizerProgress& pgo = summary.pgo;
    add(robot.plan.name, summary);
    append(rows.back(), {fixed(pgo.cost, 3), robot.summary ? std::to_string(pgo.anchor) : "-",
                         std::to_string(pgo.members.size()) + " robots"});
    sum.closures.candidates += summary.closures.candidates;
    sum.closures.verified += summary.closures.verified;
    sum.closures.inliers += summary.closures.inliers;
    sum.pgo.round = std::max(sum.pgo.round, pgo.round);
    sum.pgo.seconds = std::max(sum.pgo.seconds, pgo.seconds);
  }
  add("team", sum);
  return align_columns(rows);
}

// The bytes that the robots have sent, by category, as shares of those that the server of a
// centralised system would receive. It receives as many keypoints of a keyframe as the paper's
// system, or as many as the robots, packed equally (packed_keypoints.hpp). The map is not counted,
// because keypoints do not show it. Empty without keyframes.
std::string centralised_remark(const std::map<std::string, std::uint64_t>& traffic,
                               std::uint64_t keyframes, const PeerKeyframeCounts& received) {
  constexpr double kKeypointsOfPaper = 1000.0;
  constexpr double kKeypointBytes = 40.0;  // 8 of position and 32 of ORB descriptor
  double sent = 0.0;
  for (const auto& [category, bytes] : traffic)
    if (category != kMapTraffic) sent += static_cast<double>(bytes);
  if (sent == 0.0 || keyframes == 0) return "";
  constexpr double kPackedBytes = 16.6;
  const auto share = [&](double keypoints, double keypoint_bytes) {
    const double bytes = static_cast<double>(keyframes) * keypoints * keypoint_bytes;
    return bytes_text(bytes) + ", of which the robots send " + fixed(100.0 * sent / bytes, 1) +
           " %";
  };
  std::string remark = "A server that receives each keyframe with " + fixed(kKeypointsOfPaper, 0) +
                       " keypoints of " + fixed(kKeypointBytes, 0) + " bytes would receive\n" +
                       share(kKeypointsOfPaper, kKeypointBytes) + ".";
  if (received.keypoints > 0) {
    const double keypoints =
        static_cast<double>(received.keypoints) / static_cast<double>(received.keyframes);
    remark += " With " + fixed(keypoints, 0) + ", as many as a robot receives of\n" +
              "a keyframe, of " + fixed(kPackedBytes, 1) +
              " bytes, as robots pack them, it would receive " + share(keypoints, kPackedBytes) +
              ".";
  }
  return remark + "\n";
}

std::string traffic_table(const TeamResult& team) {
  Rows rows = {
      {"sent", "place recognition", "geometric verification", "distributed PGO", "map", "other"}};
  std::map<std::string, std::uint64_t> sums;
  std::uint64_t keyframes = 0;
  PeerKeyframeCounts received;
  const auto add = [&](const std::string& name, std::map<std::string, std::uint64_t> bytes) {
    rows.push_back({name});
    for (const char* category : kTraffic)
      rows.back().push_back(bytes_text(static_cast<double>(bytes[category])));
  };
  for (const RobotResult& robot : team.robots) {
    const RunSummary summary = robot.summary.value_or(RunSummary{});
    keyframes += summary.keyframes;
    received.keyframes += summary.peer_keyframes.keyframes;
    received.keypoints += summary.peer_keyframes.keypoints;
    for (const auto& [category, bytes] : summary.traffic) sums[category] += bytes;
    add(robot.plan.name, summary.traffic);
  }
  add("team", sums);
  return align_columns(rows) + centralised_remark(sums, keyframes, received);
}

std::string right_labels(const MeshReport& report, const MeshError& error) {
  return report.has_labels ? fixed(100.0 * error.seen.labels.total().accuracy(), 1) + '%' : "-";
}

std::vector<std::string> mesh_row(const std::string& name, const MeshChange& meshes,
                                  const MeshError& before, const MeshError& after) {
  return {name,
          std::to_string(after.faces),
          fixed(100.0 * after.coverage, 1) + '%',
          fixed(before.truth.point.mean_m, 4),
          fixed(before.seen.point.mean_m, 4),
          right_labels(meshes.before, before),
          fixed(after.truth.point.mean_m, 4),
          fixed(after.seen.point.mean_m, 4),
          right_labels(meshes.after, after)};
}

// A row per robot and one for all together; empty without comparisons.
std::string mesh_table(const TeamMeshes& meshes) {
  if (!meshes.errors) return "";
  const auto& [before, after] = *meshes.errors;
  Rows rows = {{"mesh", "faces", "covered", "odometry: error [m]", "in front", "labels",
                "optimized: error [m]", "in front", "labels"}};
  for (std::size_t k = 0; k < after.robots.size(); ++k)
    rows.push_back(
        mesh_row(after.robots[k].name, *meshes.errors, before.robots[k], after.robots[k]));
  rows.push_back(mesh_row("team, one frame", *meshes.errors, before.merged, after.merged));
  const MeshErrorOptions options;
  return align_columns(rows) +
         "Error: mean distance to the mesh from the points of the true one, " +
         fixed(after.samples_per_m2, 0) + " a square metre, within " + fixed(options.crop_m, 1) +
         " m of it\nbefore or after the optimisation, after ICP of all together. Covered: within "
         "this distance after it.\nIn front: without those that no robot can have seen. Labels: "
         "share of these that is right.\n";
}

// The findings of a robot that has ended in order: errors, and frames that a slow computer has left
// out. failures() has the other robots.
std::string findings(const RobotResult& robot) {
  std::string text;
  if (!robot.run.exit.ok()) return text;
  for (const Finding& finding : robot.summary.value_or(RunSummary{}).findings)
    if (finding.severity == Severity::kError || finding.id.starts_with("frames.") ||
        finding.id == "map.dropped_under_load")
      text += std::string(to_string(finding.severity)) + ": " + finding.what + ": " +
              finding.to_do + '\n';
  return text;
}

// Notes on the team and on robots with results. failures() has the reasons of the other robots.
std::string notes(const TeamResult& team) {
  std::string text;
  for (const std::string& note : team.notes) text.append("note: ").append(note).append("\n");
  for (const RobotResult& robot : team.robots) {
    if (robot.left_nothing()) continue;
    for (const std::string& note : robot.notes)
      text.append("note: ").append(robot.plan.name).append(": ").append(note).append("\n");
    text += findings(robot);
  }
  return text;
}

// Robots that failed in the same way, for instance by a mistyped option for all, are listed once.
std::string failures(const TeamResult& team) {
  struct Failure {
    std::string exit, last_log_lines, names;
    bool of_several = false;
  };
  std::vector<Failure> failures;
  for (const RobotResult& robot : team.robots) {
    if (robot.run.exit.ok()) continue;
    Failure failure{to_string(robot.run.exit), {}, robot.plan.name};
    for (const std::string& line : robot.run.last_log_lines)
      if (!line.empty()) failure.last_log_lines.append("  ").append(line).append("\n");
    const auto same = std::find_if(failures.begin(), failures.end(), [&](const Failure& other) {
      return other.exit == failure.exit && other.last_log_lines == failure.last_log_lines;
    });
    if (same == failures.end()) {
      failures.push_back(std::move(failure));
    } else {
      same->names.append(", ").append(failure.names);
      same->of_several = true;
    }
  }
  std::string text;
  for (const Failure& failure : failures)
    text += failure.names + " failed, " + failure.exit +
            (failure.of_several ? "; their last words:\n" : "; its last words:\n") +
            failure.last_log_lines;
  return text;
}

Json to_json(const RobotResult& robot) {
  Json json = {{"robot", robot.plan.id}, {"name", robot.plan.name}};
  if (robot.summary) json.update(*robot.summary);
  json.update({{"robot", robot.plan.id},
               {"name", robot.plan.name},
               {"exit_code", robot.run.exit.code},
               {"exit_signal", robot.run.exit.signal}});
  if (robot.odometry) json["odometry"] = *robot.odometry;
  json["in_team_frame"] = robot.in_team_frame;
  json["notes"] = robot.notes;
  return json;
}

}  // namespace

std::string to_table(const TeamResult& team) {
  const std::string remarks = notes(team) + failures(team);
  if (std::all_of(team.robots.begin(), team.robots.end(),
                  [](const RobotResult& robot) { return robot.left_nothing(); }))
    return remarks;
  std::string text =
      run_table(team) + '\n' + trajectory_table(team) + '\n' + closure_table(team) + '\n';
  if (team.closures) text += to_table(*team.closures) + '\n';
  if (const std::string meshes = mesh_table(team.meshes); !meshes.empty()) text += meshes + '\n';
  text += traffic_table(team);
  return remarks.empty() ? text : text + '\n' + remarks;
}

void to_json(Json& json, const TeamResult& team) {
  json = {{"robots", Json::array()}};
  for (const RobotResult& robot : team.robots) json["robots"].push_back(to_json(robot));
  if (team.optimized) json["optimized"] = *team.optimized;
  if (team.live) json["live"] = *team.live;
  if (team.closures) json["closures"] = *team.closures;
  if (team.meshes.errors) {
    json["meshes"] = to_json(team.meshes.errors->before, {});
    json["optimized_meshes"] = to_json(team.meshes.errors->after, {});
  }
  json["notes"] = team.notes;
}

}  // namespace km
