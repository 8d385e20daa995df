#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/robot/run_record.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/dds/traffic.hpp"

namespace km {

/// One line on how the robot is doing:
///     7.4 s, 148 images, 21 keyframes | peers: bob alive | closures: own 3>2>2, bob 14>12>10
///     | pgo: cost 12.4, round 31, with 2 | map: 812 blocks, 53 k vertices, 101 k faces
///     | out: place 81 kB, verify 210 kB, pgo 5 kB, other 2 kB | 143 MB
/// Closures are candidates > verified > inliers with each robot, counted by who found them; last
/// comes the memory that the robot occupies.
[[nodiscard]] std::string status_text(double dataset_time_s, const RunRecord& record,
                                      const std::vector<Peer>& peers,
                                      const TrafficSnapshot& traffic, std::uint64_t resident_bytes);

}  // namespace km
