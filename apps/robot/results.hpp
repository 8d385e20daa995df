#pragma once

#include <filesystem>

#include "apps/result_writer.hpp"
#include "apps/robot/run_record.hpp"

namespace km {

/// odometry.tum, optimized.tum, pose_graph.g2o, keyframes.csv and loop_closures.csv into `folder`.
void write_results(const std::filesystem::path& folder, const RunRecord& record,
                   ResultWriter& results);

/// As far as the record knows: its other fields are those of the process and its network.
[[nodiscard]] RunSummary summary_of(const RunRecord& record);

}  // namespace km
