#include "apps/robot/status_text.hpp"

#include <cstdio>
#include <map>

namespace km {
namespace {

std::string format(const char* pattern, double value) {
  char text[48];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

std::string bytes_text(std::uint64_t bytes) {
  const auto value = static_cast<double>(bytes);
  return value < 1e6 ? format("%.0f kB", value * 1e-3) : format("%.2f MB", value * 1e-6);
}

const char* to_word(PeerState state) {
  switch (state) {
    case PeerState::kAlive:
      return "alive";
    case PeerState::kLost:
      return "lost";
    case PeerState::kLeft:
      return "left";
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
  for (const auto& [robot, counts] : record.stages_per_peer()) {
    const std::string& name = names[robot];
    text += ' ' + (name.empty() ? std::to_string(robot) : name) + ' ' +
            std::to_string(counts.candidates) + '>' + std::to_string(counts.verified) + '>' +
            std::to_string(counts.inliers) + ',';
  }
  if (text.back() == ',') text.pop_back();
  return text.back() == ':' ? text + " none yet" : text;
}

std::string optimizer_text(const OptimizerProgress& progress) {
  return "pgo: cost " + format("%.4g", progress.cost) + ", round " +
         std::to_string(progress.round) + ", with " +
         std::to_string(progress.members.empty() ? 0 : progress.members.size() - 1);
}

std::string count_text(std::size_t count) {
  const auto value = static_cast<double>(count);
  if (count < 1000) return std::to_string(count);
  return count < 1'000'000 ? format("%.0f k", value * 1e-3) : format("%.2f M", value * 1e-6);
}

// Nothing where mapping is off.
std::string map_text(const std::optional<MappingProgress>& mapping) {
  if (!mapping) return "";
  return " | map: " + std::to_string(mapping->size.blocks) + " blocks, " +
         count_text(mapping->size.vertices) + " vertices, " + count_text(mapping->size.faces) +
         " faces";
}

}  // namespace

std::string status_text(double dataset_time_s, const RunRecord& record,
                        const std::vector<Peer>& peers, const TrafficSnapshot& traffic,
                        std::uint64_t resident_bytes) {
  const auto sent = [&traffic](TrafficCategory category) {
    return bytes_text(traffic.bytes(Direction::kOut, category));
  };
  return format("%.1f s, ", dataset_time_s) + std::to_string(record.odometry().size()) +
         " images, " + std::to_string(record.keyframes().size()) + " keyframes | " +
         peers_text(peers) + " | " + closures_text(record, peers) + " | " +
         optimizer_text(record.progress()) + map_text(record.mapping()) + " | out: place " +
         sent(TrafficCategory::kPlaceRecognition) + ", verify " +
         sent(TrafficCategory::kGeometricVerification) + ", pgo " +
         sent(TrafficCategory::kPoseGraphOptimization) + ", other " +
         sent(TrafficCategory::kOther) +
         format(" | %.0f MB", 1e-6 * static_cast<double>(resident_bytes));
}

}  // namespace km
