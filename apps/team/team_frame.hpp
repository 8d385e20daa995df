#pragma once

#include <string>
#include <vector>

#include "apps/team/team_results.hpp"

namespace km {

/// Finds the robots whose optimised poses are not in the frame that most robots ended in (of
/// equally many, that of the lowest anchor): sets `in_team_frame` of these to false and notes why.
/// A robot that left no summary is taken to be in it.
void find_team_frame(std::vector<RobotResult>& robots);

}  // namespace km
