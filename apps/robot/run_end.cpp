#include "apps/robot/run_end.hpp"

namespace km {
namespace {

constexpr int kNothingEstimated = 1;  // as for input that cannot be used
constexpr int kFailed = 3;

// Each image is in one of the counts.
std::string why_no_pose(const ImageCounts& images) {
  const std::size_t given = images.read + images.skipped;
  const std::size_t unusable = images.listed > given ? images.listed - given : 0;
  return "no pose estimated: of " + std::to_string(images.listed) + " images, " +
         std::to_string(unusable) + " could not be used, " + std::to_string(images.skipped) +
         " were skipped to keep the rate, " + std::to_string(images.read) +
         " were read but odometry did not start on them";
}

}  // namespace

std::string to_string(const ImageCounts& images) {
  return std::to_string(images.with_pose) + " of " + std::to_string(images.listed) +
         " images have a pose";
}

Verdict verdict_of(const RunEnd& end) {
  if (end.result.failure)
    return {kFailed, end.result.failure->node + ": " + end.result.failure->message};
  if (end.id_taken)
    return {kFailed, "another robot claimed this robot's id " + std::to_string(end.robot) +
                         ": give every robot its own --robot, and run again"};
  if (end.result.interrupted) return {0, "interrupted"};
  if (end.images && end.images->with_pose == 0)
    return {kNothingEstimated, why_no_pose(*end.images)};
  return {0, end.departure != nullptr ? end.departure : "unknown"};
}

}  // namespace km
