#include "apps/robot/status_text.hpp"

#include <map>

#include "modules/core/text_table.hpp"

namespace km {
namespace {

const char* to_word(PeerState state) {
  switch (state) {
    case PeerState::kAlive:
      return "alive";
    case PeerState::kLost:
      return "lost";
    case PeerState::kLeft:
      return "left";
    case PeerState::kReported:
      return "out of reach";
  }
  return "";
}

std::string peers_text(const std::vector<Peer>& peers) {
  if (peers.empty()) return "peers: none yet";
  std::string text = "peers:";
  for (const Peer& peer : peers) text += ' ' + peer.identity.name + ' ' + to_word(peer.state) + ',';
  text.pop_back();
  return text;
}

std::string closures_text(const RunRecord& record, const std::vector<Peer>& peers) {
  std::map<RobotId, std::string> names;
  for (const Peer& peer : peers) names[peer.identity.robot] = peer.identity.name;
  names[record.robot()] = "own";
  std::string text = "closures:";
  for (const auto& [robot, counts] : record.closure_tallies()) {
    const std::string& name = names[robot];
    text += ' ' + (name.empty() ? std::to_string(robot) : name) + ' ' +
            std::to_string(counts.candidates) + '>' + std::to_string(counts.verified) + '>' +
            std::to_string(counts.inliers) + ',';
  }
  if (text.back() == ',') text.pop_back();
  return text.back() == ':' ? text + " none yet" : text;
}

std::string optimizer_text(const OptimizerProgress& progress) {
  return "pgo: cost " + rounded(progress.cost, 4) + ", round " + std::to_string(progress.round) +
         ", with " + std::to_string(progress.members.empty() ? 0 : progress.members.size() - 1) +
         (progress.tentative.empty()
              ? ""
              : " (" + std::to_string(progress.tentative.size()) + " tentatively)") +
         (progress.located ? "" : ", not yet localised");
}

std::string count_text(std::size_t count) {
  const auto value = static_cast<double>(count);
  if (count < 1000) return std::to_string(count);
  return count < 1'000'000 ? fixed(value * 1e-3, 0) + " k" : fixed(value * 1e-6, 2) + " M";
}

// Empty if mapping is off.
std::string map_text(const std::optional<MappingProgress>& mapping) {
  if (!mapping) return "";
  return " | map: " + std::to_string(mapping->size.blocks) + " blocks, " +
         count_text(mapping->size.vertices) + " vertices, " + count_text(mapping->size.faces) +
         " faces";
}

// Empty if no message waits.
std::string waiting_text(const TrafficSnapshot& traffic) {
  std::uint64_t bytes = 0;
  for (const TopicTraffic& topic : traffic.topics) bytes += topic.held.waiting.bytes;
  return bytes == 0 ? "" : ", waiting " + bytes_text(static_cast<double>(bytes));
}

}  // namespace

std::string status_text(double dataset_time_s, const RunRecord& record,
                        const std::vector<Peer>& peers, const TrafficSnapshot& traffic,
                        std::uint64_t resident_bytes) {
  const auto sent = [&traffic](TrafficCategory category) {
    return bytes_text(static_cast<double>(traffic.bytes(Direction::kOut, category)));
  };
  return fixed(dataset_time_s, 1) + " s, " + std::to_string(record.odometry().size()) +
         " images, " + std::to_string(record.keyframes().size()) + " keyframes | " +
         peers_text(peers) + " | " + closures_text(record, peers) + " | " +
         optimizer_text(record.progress()) + map_text(record.mapping()) + " | out: place " +
         sent(TrafficCategory::kPlaceRecognition) + ", verify " +
         sent(TrafficCategory::kGeometricVerification) + ", pgo " +
         sent(TrafficCategory::kPoseGraphOptimization) + ", map " + sent(TrafficCategory::kMap) +
         ", other " + sent(TrafficCategory::kOther) + waiting_text(traffic) + " | " +
         fixed(1e-6 * static_cast<double>(resident_bytes), 0) + " MB";
}

}  // namespace km
