#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "apps/robot/process_usage.hpp"
#include "apps/robot/run_record.hpp"

namespace km {

/// Numbers of summary.json that the record does not hold.
struct RunSummary {
  std::string name;
  std::uint64_t frames = 0;                            ///< Stereo pairs played.
  std::uint64_t frames_skipped = 0;                    ///< Pairs that odometry was too slow for.
  std::map<std::string, std::uint64_t> traffic_bytes;  ///< Sent by this robot, by category.
  double seconds = 0.0;                                ///< Wall time of the run.
  ProcessUsage process;
  MemoryTrend memory;
  std::string exit_reason;
};

/// Writes poses as "time[s] tx ty tz qx qy qz qw" (TUM), nine decimals of seconds.
/// Throws std::runtime_error naming the file if it cannot be written; so do all functions below.
void write_tum(const std::filesystem::path& file, std::span<const StampedPose> poses);

/// odometry.tum, optimized.tum, pose_graph.g2o, keyframes.csv, loop_closures.csv, optimizer.csv and
/// summary.json into `folder`.
void write_results(const std::filesystem::path& folder, const RunRecord& record,
                   const RunSummary& summary);

}  // namespace km
