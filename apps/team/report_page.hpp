#pragma once

#include <filesystem>
#include <string>

#include "apps/team/team_results.hpp"
#include "modules/core/io/json.hpp"

namespace km {

/// Data of the report. Times [s] are since the robot's first pose, or (sent, process) since the
/// start of its process. Positions [m] are those of RobotPaths, seen from above:
///
///   {folder, team: as to_json(TeamResult), reasons: [text...], notes: [text...],
///    images: {"robot:keyframe": address with a small JPEG in it}, of closures, as closure_images()
///    has them,
///    map: address with a picture of the map in it, empty without a map,
///    robots: [{id, name, truth, odometry, optimized: [[x, y, t]...],
///              odometry_error, optimized_error: [[t, m]...], with a point of nulls in each of
///              pose_holes(): of the truth, else of the odometry,
///              keyframes: [[index, x, y]...],
///              closures: [[from_robot, from_keyframe, to_robot, to_keyframe, stage (number of the
///                          ClosureStage), matches, inliers, number of the reason]...],
///              rounds: [[round, cost]...], sent: {category: [[t, bytes]...]},
///              process: [[t, cpu_s, bytes]...],
///              timing: [[module, calls, median_ms, p95_ms, max_ms, total_s]...]}]}
///
/// Long series are thinned to about 1500 points. Reads the tables that the robots left below
/// `plan.output`. A missing table leaves its part empty; an unreadable one adds a note.
[[nodiscard]] Json report_data(const TeamPlan& plan, const TeamResult& team);

/// The report as one HTML document that needs no other file and no network. All text in `data` is
/// shown as text.
[[nodiscard]] std::string report_page(const Json& data);

/// Writes the report of the run. Throws std::runtime_error naming the file.
void write_report(const std::filesystem::path& file, const TeamPlan& plan, const TeamResult& team);

}  // namespace km
