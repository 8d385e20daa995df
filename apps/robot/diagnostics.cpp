#include "apps/robot/diagnostics.hpp"

#include <algorithm>
#include <utility>

#include "modules/core/text_table.hpp"
#include "runtime/clock.hpp"

namespace km {

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
                   : progress.not_joined.empty()         ? "a single place ties robots to this one"
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

}  // namespace km
