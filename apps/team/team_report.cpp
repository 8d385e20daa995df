#include "apps/team/team_report.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <sstream>

#include "apps/team/text_table.hpp"
#include "modules/evaluation/closure_report.hpp"
#include "modules/evaluation/mesh/mesh_report.hpp"
#include "modules/evaluation/trajectory_report.hpp"

namespace km {
namespace {

using Rows = std::vector<std::vector<std::string>>;

constexpr double kManySkipped = 0.05;  // of the frames: beyond, odometry is not what it could be

constexpr std::array kTraffic = {"place_recognition", "geometric_verification", "pgo", "other"};

std::string ate(const TrajectoryError* error) {
  return error != nullptr ? fixed(error->position_m.rmse, 4) : "-";
}

std::string drift(const TrajectoryError* error) {
  return error != nullptr && error->drift_percent.count > 0 ? fixed(error->drift_percent.mean, 2)
                                                            : "-";
}

std::string turn_drift(const TrajectoryError* error) {
  return error != nullptr && error->drift_deg_per_m.count > 0
             ? fixed(error->drift_deg_per_m.mean, 3)
             : "-";
}

std::string covered(const TrajectoryError* error) {
  return error != nullptr ? fixed(100.0 * error->completeness, 1) + '%' : "-";
}

const TrajectoryError* find(const std::optional<TeamError>& team, const std::string& name) {
  if (!team) return nullptr;
  const auto found = std::find_if(team->robots.begin(), team->robots.end(),
                                  [&](const TrajectoryError& e) { return e.name == name; });
  return found != team->robots.end() ? &*found : nullptr;
}

std::string end_of(const RobotResult& robot) {
  if (!robot.run.exit.ok()) return "FAILED, " + to_string(robot.run.exit);
  return robot.summary && !robot.summary->exit_reason.empty() ? robot.summary->exit_reason : "ok";
}

std::string count_text(std::uint64_t count) {
  return std::to_string(count);
}

std::string run_table(const TeamResult& team) {
  Rows rows = {{"robot", "frames", "skipped", "keyframes", "end"}};
  for (const RobotResult& robot : team.robots) {
    const RobotSummary summary = robot.summary.value_or(RobotSummary{});
    rows.push_back({robot.plan.name, count_text(summary.frames), count_text(summary.frames_skipped),
                    count_text(summary.keyframes), end_of(robot)});
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
  std::ostringstream text;
  text << "ATE: rmse. Drift: mean relative error, in percent of the way and in degrees per metre, "
          "over\npieces of the path of ";
  std::size_t left = lengths_m.size();
  for (const double length_m : lengths_m)
    text << length_m << (--left == 0 ? " m.\n" : left == 1 ? " and " : ", ");
  text
      << "Odometry is aligned with the truth robot by robot, the optimised trajectories all by one "
         "transform: that\nof a robot can be off as a whole.\n";
  return text.str();
}

std::string trajectory_table(const TeamResult& team) {
  Rows rows = {{"robot", "odometry ATE [m]", "drift [%]", "[deg/m]", "covered", "optimized ATE [m]",
                "drift [%]", "[deg/m]", "covered"}};
  for (const RobotResult& robot : team.robots) {
    const TrajectoryError* const odometry = robot.odometry ? &*robot.odometry : nullptr;
    const TrajectoryError* const optimized = find(team.optimized, robot.plan.name);
    rows.push_back({robot.plan.name, ate(odometry), drift(odometry), turn_drift(odometry),
                    covered(odometry), ate(optimized), drift(optimized), turn_drift(optimized),
                    covered(optimized)});
  }
  const TrajectoryError* const joint = team.optimized ? &team.optimized->joint : nullptr;
  rows.push_back({"team, one frame", "", "", "", "", ate(joint), drift(joint), turn_drift(joint),
                  covered(joint)});
  return align_columns(rows) + drift_remark(team);
}

std::string closure_table(const TeamResult& team) {
  Rows rows = {{"robot", "candidates", "verified", "inliers", "PGO rounds", "PGO time [s]",
                "PGO cost", "anchor", "solves with"}};
  RobotSummary sum;
  for (const RobotResult& robot : team.robots) {
    const RobotSummary s = robot.summary.value_or(RobotSummary{});
    rows.push_back({robot.plan.name, count_text(s.closure_candidates),
                    count_text(s.closures_verified), count_text(s.closures_inlier),
                    count_text(s.pgo_rounds), fixed(s.pgo_seconds, 2), fixed(s.pgo_cost, 3),
                    s.pgo_anchor ? count_text(*s.pgo_anchor) : "-",
                    count_text(s.pgo_members.size()) + " robots"});
    sum.closure_candidates += s.closure_candidates;
    sum.closures_verified += s.closures_verified;
    sum.closures_inlier += s.closures_inlier;
    sum.pgo_rounds = std::max(sum.pgo_rounds, s.pgo_rounds);
    sum.pgo_seconds = std::max(sum.pgo_seconds, s.pgo_seconds);
  }
  rows.push_back({"team", count_text(sum.closure_candidates), count_text(sum.closures_verified),
                  count_text(sum.closures_inlier), count_text(sum.pgo_rounds),
                  fixed(sum.pgo_seconds, 2)});
  return align_columns(rows);
}

std::string traffic_table(const TeamResult& team) {
  Rows rows = {{"sent", "place recognition", "geometric verification", "distributed PGO", "other"}};
  std::array<double, kTraffic.size()> sums{};
  for (const RobotResult& robot : team.robots) {
    std::vector<std::string> row = {robot.plan.name};
    for (std::size_t c = 0; c < kTraffic.size(); ++c) {
      double bytes = 0.0;
      if (robot.summary) {
        const auto& traffic = robot.summary->traffic_bytes;
        const auto entry = traffic.find(kTraffic[c]);
        if (entry != traffic.end()) bytes = static_cast<double>(entry->second);
      }
      sums[c] += bytes;
      row.push_back(bytes_text(bytes));
    }
    rows.push_back(std::move(row));
  }
  rows.push_back({"team"});
  for (const double sum : sums) rows.back().push_back(bytes_text(sum));
  return align_columns(rows);
}

// Empty unless the robot was too slow for the rate.
std::string skipped_remark(const RobotResult& robot) {
  const RobotSummary summary = robot.summary.value_or(RobotSummary{});
  const auto skipped = static_cast<double>(summary.frames_skipped);
  const double share = skipped / std::max(1.0, skipped + static_cast<double>(summary.frames));
  if (share <= kManySkipped) return "";
  return "note: " + robot.plan.name + " skipped " + fixed(100.0 * share, 0) +
         " % of its frames: use a lower --rate, or max\n";
}

// A robot that left nothing has one reason for all that is missing: how it failed.
std::string notes(const TeamResult& team) {
  std::string text;
  for (const std::string& note : team.notes) text.append("note: ").append(note).append("\n");
  for (const RobotResult& robot : team.robots) {
    if (robot.left_nothing()) continue;
    for (const std::string& note : robot.notes)
      text.append("note: ").append(robot.plan.name).append(": ").append(note).append("\n");
    text += skipped_remark(robot);
  }
  return text;
}

// Robots that failed alike, by a mistyped option of all say, are told of once.
std::string failures(const TeamResult& team) {
  struct Failure {
    std::string exit, last_words, names;
    bool of_several = false;
  };
  std::vector<Failure> failures;
  for (const RobotResult& robot : team.robots) {
    if (robot.run.exit.ok()) continue;
    Failure failure{to_string(robot.run.exit), {}, robot.plan.name};
    for (const std::string& line : robot.run.last_words)
      if (!line.empty()) failure.last_words.append("  ").append(line).append("\n");
    const auto same = std::find_if(failures.begin(), failures.end(), [&](const Failure& other) {
      return other.exit == failure.exit && other.last_words == failure.last_words;
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
            failure.last_words;
  return text;
}

void write_summary(JsonWriter& json, const RobotSummary& summary) {
  json.field("keyframes", summary.keyframes);
  json.field("frames", summary.frames);
  json.field("frames_skipped", summary.frames_skipped);
  json.key("closures");
  json.begin_object();
  json.field("candidates", summary.closure_candidates);
  json.field("verified", summary.closures_verified);
  json.field("inliers", summary.closures_inlier);
  json.end_object();
  json.key("pgo");
  json.begin_object();
  json.field("rounds", summary.pgo_rounds);
  json.field("seconds", summary.pgo_seconds);
  json.field("cost", summary.pgo_cost);
  if (summary.pgo_anchor) json.field("anchor", *summary.pgo_anchor);
  json.array("members", summary.pgo_members);
  json.end_object();
  json.key("traffic");
  json.begin_object();
  for (const auto& [category, bytes] : summary.traffic_bytes) json.field(category, bytes);
  json.end_object();
  json.field("exit_reason", summary.exit_reason);
}

void write_robot(JsonWriter& json, const RobotResult& robot) {
  json.begin_object();
  json.field("robot", robot.plan.id);
  json.field("name", robot.plan.name);
  json.field("exit_code", robot.run.exit.code);
  json.field("exit_signal", robot.run.exit.signal);
  if (robot.summary) write_summary(json, *robot.summary);
  if (robot.odometry) {
    json.key("odometry");
    write_json(json, *robot.odometry);
  }
  json.field("in_team_frame", robot.in_team_frame);
  json.array("notes", robot.notes);
  json.end_object();
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
  if (const std::string meshes = to_table(team.meshes); !meshes.empty()) text += meshes + '\n';
  text += traffic_table(team);
  return remarks.empty() ? text : text + '\n' + remarks;
}

void write_json(JsonWriter& json, const TeamResult& team) {
  json.begin_object();
  json.key("robots");
  json.begin_array();
  for (const RobotResult& robot : team.robots) write_robot(json, robot);
  json.end_array();
  if (team.optimized) {
    json.key("optimized");
    write_json(json, *team.optimized);
  }
  if (team.closures) {
    json.key("closures");
    write_json(json, *team.closures);
  }
  for (const auto& [key, report] : {std::pair("meshes", &team.meshes.odometry),
                                    std::pair("optimized_meshes", &team.meshes.optimized)}) {
    if (!*report) continue;
    json.key(key);
    write_json(json, **report, {});
  }
  json.array("notes", team.notes);
  json.end_object();
}

}  // namespace km
