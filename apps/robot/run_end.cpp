#include "apps/robot/run_end.hpp"

#include <algorithm>

#include "modules/core/io/text_table.hpp"

namespace km {
namespace {

constexpr int kNothingEstimated = 1;  // same code as for unusable input
constexpr int kFailed = 3;
constexpr int kResultsLost = 4;
constexpr int kHung = 5;

constexpr const char* kAllSettled = "all present robots have settled";

// Number of images without a pose by cause; each image counts once.
std::string why_no_pose(const ImageCounts& images) {
  const std::size_t given = images.read + images.skipped;
  const std::size_t unusable = images.listed > given ? images.listed - given : 0;
  return "of " + std::to_string(images.listed) + " images, " + std::to_string(unusable) +
         " could not be used, " + std::to_string(images.skipped) +
         " were skipped because processors were short, " + std::to_string(images.read) +
         " were read but odometry did not start on them";
}

// settled_links of a settled robot: one more than the smallest value among its present peers.
std::uint8_t settled_links(std::span<const Departure::Present> peers) {
  std::uint8_t links = kMaxSettledLinks;
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

  // The robot reports itself as settled after half of the settling time. Its peers answer in the
  // other half.
  const bool settled =
      inputs.graph_settled && !inputs.awaits_peers && now_s - active_s_ >= 0.5 * settle_s_;
  const std::uint8_t links = settled ? settled_links(inputs.present_peers) : 0;
  const bool peers_settled = links > 1;
  // The distance in links to a robot that is not received is at most the number of such robots plus
  // one.
  const bool all_settled =
      peers_settled && links > std::min(inputs.not_received + 1, std::size_t{kMaxSettledLinks} - 1);
  if (!all_settled) all_settled_s_.reset();
  if (all_settled && !all_settled_s_) all_settled_s_ = now_s;
  // A peer that leaves has waited for all others.
  const bool peer_leaves =
      peers_settled &&
      std::any_of(inputs.present_peers.begin(), inputs.present_peers.end(),
                  [](const Present& peer) { return peer.phase == RobotPhase::kLeaving; });
  if (peer_leaves || (all_settled && now_s - *all_settled_s_ >= settle_s_))
    reason_ = kAllSettled;
  else if (now_s - *ended_s_ >= serve_limit_s_)
    reason_ = "time limit for serving peers";
  return {settled ? RobotPhase::kSettled : RobotPhase::kFinished, links};
}

void Absentees::update(double now_s, const std::map<RobotId, Known>& known,
                       std::span<const RobotId> members) {
  now_s_ = now_s;
  std::map<RobotId, Missed> missed;
  for (const auto& [robot, peer] : known) {
    if (peer.state == PeerState::kAlive)
      received_s_[robot] = now_s;
    else if (peer.state != PeerState::kLost)
      received_s_.erase(robot);
    if (peer.state == PeerState::kLeft || std::ranges::find(members, robot) != members.end())
      continue;
    const bool second_hand = peer.state == PeerState::kReported;
    if (second_hand && !ever_members_.contains(robot)) continue;
    const Absence why = peer.state == PeerState::kAlive ? Absence::kApart : Absence::kSilent;
    miss(robot, {.name = peer.name, .why = why, .second_hand = second_hand}, missed);
  }
  for (const RobotId robot : ever_members_)
    if (!known.contains(robot) && std::ranges::find(members, robot) == members.end())
      miss(robot, {.name = "robot " + std::to_string(robot), .second_hand = true}, missed);
  missed_ = std::move(missed);
  ever_members_.insert(members.begin(), members.end());
}

// Keeps the time since which the robot is missed, as long as the reason is the same.
void Absentees::miss(RobotId robot, const Missed& missed, std::map<RobotId, Missed>& now) const {
  const auto before = missed_.find(robot);
  const bool continues = before != missed_.end() && before->second.why == missed.why;
  now.emplace(robot, missed).first->second.since_s = continues ? before->second.since_s : now_s_;
}

bool Absentees::is_present(RobotId robot, double patience_s) const {
  const auto received = received_s_.find(robot);
  return received != received_s_.end() && now_s_ - received->second < patience_s;
}

std::vector<MissedPeer> Absentees::missed(double second_hand_s) const {
  std::vector<MissedPeer> peers;
  for (const auto& [robot, missed] : missed_) {
    const double missed_s = now_s_ - missed.since_s;
    if (!missed.second_hand || missed_s >= second_hand_s)
      peers.push_back({missed.name, missed.why, missed_s});
  }
  return peers;
}

std::string to_string(const ImageCounts& images) {
  return std::to_string(images.with_pose) + " of " + std::to_string(images.listed) +
         " images have a pose";
}

namespace {

// "bob (not received for 31.2 s), carol (received, but not in one frame for 7.0 s)"
std::string names_of(const RunEnd& end) {
  std::string text;
  for (const MissedPeer& peer : end.missed)
    text += (text.empty() ? "" : ", ") + peer.name +
            (peer.why == Absence::kSilent ? " (not received for "
                                          : " (received, but not in one frame for ") +
            fixed(peer.missed_s, 1) + " s)";
  for (const auto& [name, why] : end.unmet)
    text += (text.empty() ? "" : ", ") + name + " (never met: " + why + ')';
  return text;
}

Verdict verdict_of_run(const RunEnd& end) {
  if (end.result.failure)
    return {end.result.failure->hung ? kHung : kFailed,
            end.result.failure->node + ": " + end.result.failure->message};
  if (end.id_taken)
    return {kFailed, "another robot has this robot's id " + std::to_string(end.robot) +
                         ": give every robot its own --robot, and run again"};
  if (end.is_live && end.images && end.images->read + end.images->skipped == 0)
    return {kNothingEstimated,
            "no image came: kimera_multi_doctor --live RIG shows which topic is silent, and why"};
  if (end.result.interrupted) return {0, "interrupted"};
  if (end.images && end.images->with_pose == 0)
    return {kNothingEstimated,
            "no pose estimated: " +
                (end.odometry_fault.empty() ? why_no_pose(*end.images) : end.odometry_fault)};
  if (!end.odometry_fault.empty())
    return {kNothingEstimated, "odometry is wrong: " + end.odometry_fault};
  const std::string departure = end.departure != nullptr ? end.departure : "unknown";
  if (end.missed.empty() && end.unmet.empty())
    return {0, end.is_alone && departure == kAllSettled ? "settled; no other robot was met"
                                                        : departure};
  return {0, (departure == kAllSettled ? "settled" : departure) + " without " + names_of(end)};
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
