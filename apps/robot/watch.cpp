#include "apps/robot/watch.hpp"

#include <algorithm>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr double kInterval_s = 1.0;  // between rows of a CSV, and status lines
// Threads free what other threads allocate, so that free memory spreads over the heaps of all
// threads. Returned each minute, it costs a robot the page faults of a few images.
constexpr double kTrimInterval_s = 60.0;
constexpr double kLeaveNotice_s = 1.5;  // three times the period of the status
// In a chain, robots leave one after the other. The first ones have left before the last one
// receives a notice.
constexpr double kSecondHand_s = 2.0 * kLeaveNotice_s;

std::vector<std::string> other_hosts(const RobotConfig& config, const NetworkInterface& own) {
  std::vector<std::string> hosts;
  for (const std::string& host : config.dds.peers)
    if (!host.starts_with("127.") && host != own.address) hosts.push_back(host);
  return hosts;
}

}  // namespace

Watch::Watch(const RobotOptions& options, const RobotConfig& config, bool continues,
             std::set<RobotId> partners, Robot& robot, ResultWriter& results)
    : robot_(robot),
      is_past_(!options.session.empty()),
      partners_(std::move(partners)),
      serve_limit_s_(options.serve_limit_s),
      lease_s_(config.dds.lease_s),
      departure_(config.run.settle_s, options.serve_limit_s),
      unmet_(other_hosts(config, robot.interface())),
      start_s_(steady_now_s()),
      traffic_file_(options.output / "traffic.csv", results),
      traffic_csv_(traffic_file_.rows(), continues ? traffic_file_.go_on() : std::string()),
      process_file_(options.output / "process.csv", results),
      process_csv_(process_file_.rows(), continues ? process_file_.go_on() : std::string()),
      rounds_file_(options.output / "optimizer.csv", results),
      rounds_csv_(rounds_file_.rows(), continues ? rounds_file_.go_on() : std::string()) {}

double Watch::seconds() const {
  return steady_now_s() - start_s_;
}

std::vector<MissedPeer> Watch::missed() const {
  return absentees_.missed(kSecondHand_s);
}

bool Watch::poll() {
  const double now_s = seconds();
  const TrafficSnapshot traffic = robot_.bridge().traffic();
  const bool ended = robot_.input_ended();  // before the record is read, which is then complete
  // If the recorder is at work, the next call reads the record: this thread does not wait.
  (void)robot_.records().recorder().try_with_record([&](const RunRecord& record) {
    log_progress(now_s, record, traffic);
    rounds_csv_.append(record.rounds());
    if (!leaving_since_s_) update_phase(now_s, ended, record);
  });
  if (now_s - written_s_ >= kInterval_s) write(now_s, traffic);
  if (now_s - sampled_s_ >= kInterval_s && !leaving_since_s_) sample(now_s);
  if (now_s >= next_trim_s_) {
    return_freed_memory();
    next_trim_s_ = now_s + kTrimInterval_s;
  }
  return robot_.back_end().id_taken() ||
         (departure_.reason() != nullptr && leave_notice_sent(now_s));
}

void Watch::update_phase(double now_s, bool ended, const RunRecord& record) {
  const auto& team = record.progress().members;
  absentees_.update(now_s, known_peers(), team);
  unmet_.update(now_s, robot_.bridge().peers().list(),
                robot_.bridge().peers().ask(&PeerTable::unmet));
  const std::map<RobotId, Departure::Present> peers = present_peers();
  std::vector<Departure::Present> present;
  for (const auto& [robot, peer] : peers) present.push_back(peer);
  const auto not_received = std::count_if(team.begin(), team.end(), [&](RobotId member) {
    return member != record.robot() && !peers.contains(member);
  });
  // Messages that wait for the budget may change the graphs of other robots.
  const bool settled =
      record.settled() && !robot_.bridge().holds_back() && robot_.mapping().is_shared();
  const auto reported =
      departure_.update(now_s, {.input_ended = ended,
                                .graph_settled = settled,
                                .activity = record.activity(),
                                .present_peers = present,
                                .not_received = static_cast<std::size_t>(not_received),
                                .awaits_peers = ended && awaits_peers(now_s, team)});
  robot_.records().progress().set_settled(reported);
  const auto running = [](const auto& peer) { return peer.phase == RobotPhase::kRunning; };
  if (reported.phase == RobotPhase::kSettled && std::ranges::none_of(present, running))
    robot_.back_end().expect_no_more_closures();
}

void Watch::finish(const RunRecord& record) {
  rounds_csv_.append(record.rounds());
  const TrafficSnapshot traffic = robot_.bridge().traffic();
  write(seconds(), traffic);
  show_status(record, traffic);
}

// The robot of a finished run awaits any other robot. A recorded graph has closures to robots that
// may start later.
bool Watch::awaits_peers(double now_s, std::span<const RobotId> team) {
  const std::vector<Peer> met = robot_.bridge().peers().list();
  for (const Peer& peer : met) partners_.erase(peer.identity.robot);
  for (const RobotId robot : team) partners_.erase(robot);  // that other robots receive
  if (!partners_.empty() && !std::exchange(told_, true)) {
    std::string names;
    for (const RobotId robot : partners_) names += ' ' + std::to_string(robot);
    log::info("robot") << "closures of the graph lead to robots that have not come:" << names
                       << "; waits for them, up to --serve-limit " << serve_limit_s_ << " s";
  }
  return !partners_.empty() || (is_past_ && met.empty()) || unmet_.awaits(now_s);
}

// Publishes that the robot leaves, and freezes the record, so that all robots end with the same
// solution. True once the peers have had the time to receive this.
bool Watch::leave_notice_sent(double now_s) {
  if (!leaving_since_s_) {
    leaving_since_s_ = now_s;
    robot_.records().progress().set_settled({RobotPhase::kLeaving, kMaxSettledLinks});
    sample(now_s);
    robot_.freeze_record();
  }
  return robot_.bridge().peers().list().empty() || now_s - *leaving_since_s_ >= kLeaveNotice_s;
}

// Less often than poll(), because the time to count closures grows with their number.
void Watch::log_progress(double now_s, const RunRecord& record, const TrafficSnapshot& traffic) {
  if (now_s - logged_s_ < kInterval_s) return;
  logged_s_ = now_s;
  show_status(record, traffic);
}

void Watch::show_status(const RunRecord& record, const TrafficSnapshot& traffic) {
  std::vector<Peer> peers = robot_.bridge().peers().list();
  for (const RobotStatus& status : robot_.records().statuses().peers())
    for (Peer& peer : peers)
      if (status.phase == RobotPhase::kLeaving && peer.identity.robot == status.robot &&
          peer.identity.boot == status.boot)
        peer.state = PeerState::kLeft;  // also before it falls silent
  status_line_.update(status_text(robot_.records().progress().input_s(), record, peers, traffic,
                                  process_usage().resident_bytes));
}

// A peer whose last status announced that it leaves, and that is silent now, has left.
std::map<RobotId, Absentees::Known> Watch::known_peers() const {
  std::map<RobotId, Absentees::Known> known;
  for (const Peer& peer : robot_.bridge().peers().list())
    known[peer.identity.robot] = {peer.identity.name, peer.state};
  for (const RobotStatus& status : robot_.records().statuses().peers()) {
    const auto peer = known.find(status.robot);
    if (status.phase == RobotPhase::kLeaving && peer != known.end() &&
        peer->second.state == PeerState::kLost)
      peer->second.state = PeerState::kLeft;
  }
  return known;
}

// A peer that is silent may be busy, and counts with its last status for the lease. One that is
// present but has not yet sent a status counts as running, regardless of the last status of its
// former process.
std::map<RobotId, Departure::Present> Watch::present_peers() const {
  std::map<TeamPeer, Departure::Present> reported;
  for (const RobotStatus& status : robot_.records().statuses().peers())
    reported[{status.robot, status.boot}] = {status.phase, status.settled_links};
  std::map<RobotId, Departure::Present> present;
  for (const auto& [identity, state, addresses] : robot_.bridge().peers().list())
    if (absentees_.is_present(identity.robot, lease_s_))
      present[identity.robot] = reported[{identity.robot, identity.boot}];
  return present;
}

void Watch::sample(double now_s) {
  sampled_s_ = now_s;
  robot_.records().publish_sample();
}

void Watch::write(double now_s, const TrafficSnapshot& traffic) {
  const double run_s = process_csv_.former_s() + now_s;
  traffic_csv_.append(run_s, traffic);
  traffic_file_.flush();
  process_csv_.append(run_s, process_usage());
  process_file_.flush();
  rounds_file_.flush();
  written_s_ = now_s;
}

}  // namespace km
