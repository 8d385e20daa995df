#include "apps/robot/run_end.hpp"

#include <algorithm>

#include "modules/core/text_table.hpp"

namespace km {
namespace {

constexpr int kNothingEstimated = 1;  // as for input that cannot be used
constexpr int kFailed = 3;
constexpr int kResultsLost = 4;
constexpr int kHung = 5;

// Each image is in one of the counts.
std::string why_no_pose(const ImageCounts& images) {
  const std::size_t given = images.read + images.skipped;
  const std::size_t unusable = images.listed > given ? images.listed - given : 0;
  return "no pose estimated: of " + std::to_string(images.listed) + " images, " +
         std::to_string(unusable) + " could not be used, " + std::to_string(images.skipped) +
         " were skipped to keep the rate, " + std::to_string(images.read) +
         " were read but odometry did not start on them";
}

// Of a robot that has settled itself.
std::uint8_t settled_links(std::span<const Departure::Present> peers) {
  std::uint8_t links = kManyLinks;
  for (const Departure::Present& peer : peers)
    if (peer.phase != RobotPhase::kLeaving && peer.settled_links < links)
      links = static_cast<std::uint8_t>(peer.settled_links + 1);
  return links;
}

}  // namespace

Departure::Present Departure::update(double now_s, const Inputs& inputs) {
  if (inputs.activity != activity_) active_s_ = now_s;
  activity_ = inputs.activity;
  if (!inputs.input_ended) return {RobotPhase::kRunning, 0};
  if (!ended_s_) ended_s_ = now_s;

  // Half of the time quiet before saying so: the other half is for the peers to answer.
  const bool settled = inputs.graph_settled && now_s - active_s_ >= 0.5 * settle_s_;
  const std::uint8_t links = settled ? settled_links(inputs.present_peers) : 0;
  const bool peers_settled = links > 1;
  // A robot that is not heard is at most as many links away as there are such robots, and one more.
  const bool all_settled =
      peers_settled && links > std::min(inputs.unheard + 1, std::size_t{kManyLinks} - 1);
  if (!all_settled) all_settled_s_.reset();
  if (all_settled && !all_settled_s_) all_settled_s_ = now_s;
  // Who leaves has waited for all.
  const bool told =
      peers_settled &&
      std::any_of(inputs.present_peers.begin(), inputs.present_peers.end(),
                  [](const Present& peer) { return peer.phase == RobotPhase::kLeaving; });
  if (told || (all_settled && now_s - *all_settled_s_ >= settle_s_))
    reason_ = "all present robots have settled";
  else if (now_s - *ended_s_ >= serve_limit_s_)
    reason_ = "time limit for serving peers";
  return {settled ? RobotPhase::kSettled : RobotPhase::kFinished, links};
}

void SilentPeers::update(double now_s, const std::map<RobotId, std::string>& silent) {
  now_s_ = now_s;
  std::erase_if(silent_, [&](const auto& entry) { return !silent.contains(entry.first); });
  for (const auto& [robot, name] : silent) silent_.try_emplace(robot, Silence{name, now_s});
}

std::vector<LostPeer> SilentPeers::lost(std::span<const RobotId> reached) const {
  std::vector<LostPeer> lost;
  for (const auto& [robot, silence] : silent_)
    if (std::ranges::find(reached, robot) == reached.end())
      lost.push_back({silence.name, now_s_ - silence.since_s});
  return lost;
}

std::string to_string(const ImageCounts& images) {
  return std::to_string(images.with_pose) + " of " + std::to_string(images.listed) +
         " images have a pose";
}

namespace {

// "without bob (silent for 31.2 s), carol (silent for 7.0 s)"
std::string without(const std::vector<LostPeer>& lost) {
  std::string text = "without";
  for (const char* separator = " "; const LostPeer& peer : lost) {
    text += separator + peer.name + " (silent for " + fixed(peer.silent_s, 1) + " s)";
    separator = ", ";
  }
  return text;
}

Verdict verdict_of_run(const RunEnd& end) {
  if (end.result.failure)
    return {end.result.failure->hung ? kHung : kFailed,
            end.result.failure->node + ": " + end.result.failure->message};
  if (end.id_taken)
    return {kFailed, "another robot has this robot's id " + std::to_string(end.robot) +
                         ": give every robot its own --robot, and run again"};
  if (end.result.interrupted) return {0, "interrupted"};
  if (end.images && end.images->with_pose == 0)
    return {kNothingEstimated, why_no_pose(*end.images)};
  const std::string departure = end.departure != nullptr ? end.departure : "unknown";
  return {0, end.lost_peers.empty() ? departure : without(end.lost_peers) + ": " + departure};
}

}  // namespace

Verdict verdict_of(const RunEnd& end) {
  Verdict verdict = verdict_of_run(end);
  if (end.lost_results.empty()) return verdict;
  if (verdict.exit_code == 0) verdict.exit_code = kResultsLost;
  const std::size_t lost = end.lost_results.size();
  verdict.reason += "; " + std::to_string(lost) + (lost == 1 ? " result lost" : " results lost");
  for (const char* separator = ": "; const auto& [file, why] : end.lost_results) {
    verdict.reason += separator + why;
    separator = "; ";
  }
  return verdict;
}

}  // namespace km
