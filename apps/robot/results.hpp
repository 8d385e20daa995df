#pragma once

#include <filesystem>

#include "apps/result_writer.hpp"
#include "apps/robot/run_record.hpp"
#include "modules/ros_dds/drawings.hpp"

namespace km {

/// Writes odometry.tum, live.tum, optimized.tum, optimized_keyframes.tum, pose_graph.g2o,
/// keyframes.csv and loop_closures.csv to `folder`.
void write_results(const std::filesystem::path& folder, const RunRecord& record,
                   ResultWriter& results);

/// Every candidate of the robot, in the form in which viewers receive it.
[[nodiscard]] std::vector<PublishedClosure> published_closures(const RunRecord& record);

/// Summary of the record; the fields that concern the process and its network keep their defaults.
[[nodiscard]] RunSummary summary_of(const RunRecord& record);

}  // namespace km
