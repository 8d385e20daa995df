#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/robot/run_record.hpp"
#include "runtime/dds/bridge.hpp"

namespace km {

/// Status line of the robot:
///     7.4 s, 148 images, 21 keyframes | peers: bob alive | closures: own 3>2>2, bob 14>12>10
///     | pgo: cost 12.4, round 31, with 2 | map: 812 blocks, 53 k vertices, 101 k faces
///     | out: place 81.3 kB, verify 210.4 kB, pgo 5.0 kB, other 2.1 kB, waiting 12.1 kB | 143 MB
/// Closures are counted as candidates > verified > inliers for each robot, by the robot that found
/// them. Bytes that wait for the budget are shown if there are any. The last number is the resident
/// memory. kimera_multi_team reads the first number.
[[nodiscard]] std::string status_text(double dataset_time_s, const RunRecord& record,
                                      const std::vector<Peer>& peers,
                                      const TrafficSnapshot& traffic, std::uint64_t resident_bytes);

}  // namespace km
