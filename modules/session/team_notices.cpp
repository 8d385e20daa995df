#include "modules/session/team_notices.hpp"

#include <algorithm>
#include <iterator>

#include "modules/core/io/text_table.hpp"
#include "modules/session/team_message_bytes.hpp"

namespace km {
namespace {

// kNoisyOdometry: ratio of the noise of odometry to the claimed noise that causes a notice.
// kNoticedAgain: ratio of the noise of odometry or closures to that in the last notice that causes
// another one.
constexpr double kNoisyOdometry = 2.0;
constexpr double kNoticedAgain = 1.5;

// Largest number of distinct reasons of refusals: they contain robot ids, which a sender can
// invent.
constexpr std::size_t kReasons = 1000;

// "robot 1", or "robots 1, 2": the robots of `now` that `before` lacks; both ascending. Empty if
// there are none.
std::string added(const std::vector<RobotId>& now, const std::vector<RobotId>& before) {
  std::vector<RobotId> robots;
  std::ranges::set_difference(now, before, std::back_inserter(robots));
  std::string text = robots.empty() ? "" : robots.size() == 1 ? "robot" : "robots";
  for (const RobotId robot : robots)
    text += (robot == robots.front() ? " " : ", ") + std::to_string(robot);
  return text;
}

}  // namespace

bool TeamNotices::refuse(const std::string& reason) {
  const bool counted = refused_.size() < kReasons || refused_.contains(reason);
  const std::string& known = counted ? reason : "for reasons of which there are too many";
  const std::size_t times = ++refused_[known];
  const bool power_of_two = (times & (times - 1)) == 0;
  if (power_of_two) add("refused (" + std::to_string(times) + " times): " + known);
  return false;
}

void TeamNotices::odometry(const OdometryNoise& noise) {
  const double worst = std::max(noise.rotation, noise.translation);
  if (!(worst >= kNoisyOdometry && worst >= kNoticedAgain * odometry_noise_)) return;
  odometry_noise_ = worst;
  add("odometry is " + fixed(noise.rotation, 1) + " times noisier in rotation and " +
      fixed(noise.translation, 1) + " times in translation than it claims, by " +
      std::to_string(noise.places) +
      " places of loop closures inside this robot; it is weighed accordingly");
}

void TeamNotices::message(std::size_t bytes) {
  const auto size = static_cast<double>(bytes);
  if (bytes <= kMaxTeamMessageBytes || size < kNoticedAgain * static_cast<double>(largest_message_))
    return;
  largest_message_ = bytes;
  add("the equations of this session take " + fixed(1e-6 * size, 1) + " MB, and robots exchange " +
      fixed(1e-6 * static_cast<double>(kMaxTeamMessageBytes), 1) +
      " MB at most: the session ends without a solution, and the last solution stays. Too many "
      "keyframes have closures with other robots: set pose_graph.method=rbcd on all robots, which "
      "sends no equations");
}

void TeamNotices::breaks(std::span<const OdometryBreak> breaks) {
  for (const OdometryBreak& found : breaks) {
    if (!breaks_.insert(found.step).second) continue;
    add("odometry is wrong near keyframe " + std::to_string(found.step) + ": closures at " +
        std::to_string(found.places) + " places agree on a jump of " + fixed(found.jump_m, 2) +
        " m and " + fixed(found.jump_rad, 3) +
        " rad; the step is corrected (pose_graph.correct_odometry=false: it stays as measured)");
  }
}

void TeamNotices::closures(const ClosureNoiseRecord& noise) {
  for (const auto& [peer, cycles] : noise.pairs) {
    double& last = closure_factors_.try_emplace(peer, 1.0).first->second;
    if (!(cycles.factor >= kNoticedAgain * last)) continue;
    last = cycles.factor;
    add((peer == self_ ? "closures inside this robot"
                       : "closures with robot " + std::to_string(peer)) +
        " are " + fixed(cycles.factor, 1) +
        " times noisier than closures of the team usually are, by " + fixed(cycles.places, 0) +
        " places; they are weighed accordingly");
  }
}

void TeamNotices::other_datum(RobotId robot) {
  if (!other_datum_.insert(robot).second) return;
  add("robot " + std::to_string(robot) +
      " is located in another frame: give all robots the same absolute_fixes.source and "
      "absolute_fixes.datum, or the same --localize");
}

void TeamNotices::ties(const FrameTies& ties) {
  if (ties == ties_) return;
  if (const std::string robots = added(ties.tentative, ties_.tentative); !robots.empty())
    add("joined tentatively with " + robots +
        ", by closures along a single stretch of their paths; closures at another place will "
        "confirm or correct it");
  if (const std::string robots = added(ties.not_joined, ties_.not_joined); !robots.empty())
    add("no accepted closure ties " + robots +
        " to this robot without a contradiction: their frames differ");
  std::vector<RobotId> uncertain;
  std::ranges::set_union(ties.tentative, ties.not_joined, std::back_inserter(uncertain));
  if (const std::string robots = added(ties_.tentative, uncertain); !robots.empty())
    news_.push_back("no longer joined tentatively, but by closures at several places: with " +
                    robots);
  ties_ = ties;
}

}  // namespace km
