#include "apps/team/team_frame.hpp"

#include <algorithm>
#include <map>
#include <optional>

namespace km {
namespace {

// The robot whose odometry frame the optimised poses are in: a robot that solved with no other has
// its own.
std::optional<RobotId> frame_of(const RobotResult& robot) {
  if (!robot.summary) return std::nullopt;
  const RobotSummary& summary = *robot.summary;
  return summary.pgo_members.size() > 1 ? summary.pgo_anchor : robot.plan.id;
}

}  // namespace

void find_team_frame(std::vector<RobotResult>& robots) {
  std::map<RobotId, int> sizes;
  for (const RobotResult& robot : robots)
    if (const auto frame = frame_of(robot)) ++sizes[*frame];
  // The first of equal ones is that of the lowest anchor.
  const auto team = std::max_element(
      sizes.begin(), sizes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  for (RobotResult& robot : robots) {
    const auto frame = frame_of(robot);
    if (!frame || *frame == team->first) continue;
    robot.in_team_frame = false;
    robot.notes.push_back((*frame == robot.plan.id && sizes[*frame] == 1
                               ? std::string("never joined the others")
                               : "ended in the frame of robot " + std::to_string(*frame)) +
                          ": left out of the optimised errors, the drawing and the team's map");
  }
}

}  // namespace km
