#include "apps/robot/status.hpp"

#include <algorithm>
#include <array>

#include "modules/core/io/text_table.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

const char* to_word(PeerState state) {
  constexpr std::array kWords = {"alive", "lost", "left", "out of reach"};  // as the enumerators
  return kWords.at(static_cast<std::size_t>(state));
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

RosDiagnosticStatus sensors_status(std::size_t published, std::size_t skipped,
                                   const ReaderReport& faults) {
  RosDiagnosticStatus status;
  status.name = "sensors";
  status.values = {{"frames", std::to_string(published)},
                   {"skipped frames", std::to_string(skipped)}};
  for (const auto& [fault, entry] : faults.entries())
    status.values.push_back(
        {to_string(fault), std::to_string(entry.count) + ", first: " + entry.first});
  const bool is_well = skipped == 0 && faults.empty();
  status.level = is_well ? RosLevel::kOk : RosLevel::kWarn;
  status.message = is_well          ? "ok"
                   : faults.empty() ? "frames are skipped: odometry is too slow"
                                    : "faulty: see below";
  return status;
}

RosDiagnosticStatus team_status(const OptimizerProgress& progress) {
  const auto list = [](const std::vector<RobotId>& robots) {
    if (robots.empty()) return std::string("none");
    std::string text;
    for (const RobotId robot : robots) {
      if (!text.empty()) text += ' ';
      text += std::to_string(robot);
    }
    return text;
  };
  RosDiagnosticStatus status;
  status.name = "team";
  status.values = {{"frame of robot", std::to_string(progress.anchor)},
                   {"optimises with robots", list(progress.members)},
                   {"tentative robots", list(progress.tentative)},
                   {"robots in another frame", list(progress.not_joined)}};
  const bool is_certain =
      progress.located && progress.tentative.empty() && progress.not_joined.empty();
  status.level = is_certain ? RosLevel::kOk : RosLevel::kWarn;
  status.message = is_certain                            ? "ok"
                   : progress.fixes && !progress.located ? "not yet located by its fixes"
                   : !progress.located                   ? "not yet localised in the finished map"
                   : progress.not_joined.empty()
                       ? "a single stretch of their paths ties robots to this one"
                       : "no accepted closure ties robots to this one";
  return status;
}

ModuleLoads::ModuleLoads(std::vector<const Node*> nodes)
    : nodes_(std::move(nodes)), asked_s_(steady_now_s()) {}

std::vector<std::pair<std::string, double>> ModuleLoads::shares() {
  const double now_s = steady_now_s();
  const double elapsed_s = std::max(now_s - std::exchange(asked_s_, now_s), 1e-3);
  std::vector<std::pair<std::string, double>> shares;
  for (const Node* node : nodes_) {
    const double total_s = node->timing().total_s();
    const double spent_s = total_s - std::exchange(spent_s_[node], total_s);
    shares.emplace_back(node->name(), spent_s / elapsed_s);
  }
  return shares;
}

RosDiagnosticStatus ModuleLoads::status() {
  constexpr double kBusy = 0.95;
  RosDiagnosticStatus status;
  status.name = "modules";
  for (const auto& [name, share] : shares()) {
    status.values.push_back({name + " busy [%]", fixed(100.0 * share, 0)});
    if (share > kBusy) status.message += (status.message.empty() ? "busy: " : ", ") + name;
  }
  if (!status.message.empty()) status.level = RosLevel::kWarn;
  if (status.message.empty()) status.message = "ok";
  return status;
}

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
