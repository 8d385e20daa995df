#pragma once

#include <filesystem>

#include "apps/result_writer.hpp"
#include "apps/robot/run_record.hpp"
#include "modules/ros_dds/closure_lines.hpp"

namespace km {

/// odometry.tum, optimized.tum, pose_graph.g2o, keyframes.csv and loop_closures.csv into `folder`.
void write_results(const std::filesystem::path& folder, const RunRecord& record,
                   ResultWriter& results);

/// Every candidate of the robot, as viewers are told of it.
[[nodiscard]] std::vector<ToldClosure> told_closures(const RunRecord& record);

/// As far as the record knows: its other fields are those of the process and its network.
[[nodiscard]] RunSummary summary_of(const RunRecord& record);

}  // namespace km
