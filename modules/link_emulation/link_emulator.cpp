#include "modules/link_emulation/link_emulator.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "modules/core/config.hpp"

namespace km {
namespace {

constexpr std::size_t kHeader_bytes = 14;  // Ethernet header: both addresses and the type
constexpr std::size_t kMaxRobots = 65536;  // the address has two bytes for the number

bool is_possible(const LinkPlan& link) {
  return link.jitter_s >= 0.0 && std::isfinite(link.jitter_s) && link.loss >= 0.0 &&
         link.loss <= 1.0 && link.queue_bytes >= 0.0 && link.range_m >= 0.0;
}

void check_script(const LinkScript& script) {
  const std::size_t n = script.robots;
  const auto require = [](bool ok, const char* problem) {
    if (!ok) throw std::invalid_argument(std::string("LinkEmulator: ") + problem);
  };
  require(n <= kMaxRobots, "more robots than addresses");
  require(script.links.size() == n * n, "a link is needed for each ordered pair");
  require(std::ranges::all_of(script.links, is_possible), "a link has an impossible number");
  const bool ranges = std::ranges::any_of(
      script.links, [](const LinkPlan& link) { return std::isfinite(link.range_m); });
  require(!ranges || script.paths.size() == n, "a range needs the path of every robot");
  for (const auto& path : script.paths) {
    require(!path.empty(), "a path has no position");
    require(std::ranges::is_sorted(path, {}, &PathPoint::time_s), "a path goes back in time");
  }
  for (const LinkPartition& partition : script.partitions)
    require(partition.group_of.size() == n, "a partition needs the group of every robot");
}

// Time at which a frame of `bytes` has left the queue, if it is sent now; nullopt if it does not
// fit into the queue. `queue_end`: capacity_until() the end of the queue, which the frame moves.
template <typename Capacity>
std::optional<double> leave_queue(const Capacity& link, double bytes, double queue_bytes,
                                  double now_s, double& queue_end) {
  const double carried = link.capacity_until(now_s);
  const double end = std::max(queue_end, carried) + bytes;
  if (end - carried > queue_bytes) return std::nullopt;
  queue_end = end;
  return std::max(now_s, link.time_of(end));
}

// That time for the link of a plan.
std::optional<double> leave_queue(const LinkPlan& link, std::size_t frame_bytes, double now_s,
                                  double& queue_end) {
  if (link.packets)
    return leave_queue(*link.packets, static_cast<double>(frame_bytes - kHeader_bytes),
                       link.queue_bytes, now_s, queue_end);
  if (!link.trace.has_limit()) return now_s;
  return leave_queue(link.trace, static_cast<double>(frame_bytes), link.queue_bytes, now_s,
                     queue_end);
}

}  // namespace

std::array<std::uint8_t, 6> ethernet_address(std::size_t robot) {
  constexpr std::uint8_t kLocal = 0x02;
  return {kLocal,
          'k',
          'm',
          0,
          static_cast<std::uint8_t>(robot >> 8U),
          static_cast<std::uint8_t>(robot)};
}

LinkEmulator::LinkEmulator(LinkScript script)
    : script_(std::move(script)), progress_(script_.robots) {
  check_script(script_);
  for (std::size_t from = 0; from < script_.robots; ++from)
    for (std::size_t to = 0; to < script_.robots; ++to) {
      std::seed_seq seed{script_.seed, static_cast<unsigned>(from), static_cast<unsigned>(to)};
      states_.push_back({.rng = std::mt19937(seed)});
    }
}

void LinkEmulator::set_progress(std::size_t robot, double now_s, double recorded_s) {
  progress_.at(robot) = {now_s, recorded_s};
}

void LinkEmulator::send(std::size_t from, double now_s, const EthernetFrame& frame) {
  if (frame.size() < kHeader_bytes) return;
  const bool to_many = (static_cast<std::uint8_t>(frame[0]) & 1U) != 0;
  for (std::size_t to = 0; to < script_.robots; ++to) {
    const auto address = ethernet_address(to);
    if (to != from && (to_many || std::memcmp(frame.data(), address.data(), address.size()) == 0))
      send_over(from, to, now_s, frame);
  }
}

void LinkEmulator::send_over(std::size_t from, std::size_t to, double now_s,
                             const EthernetFrame& frame) {
  const LinkPlan& link = script_.link(from, to);
  State& state = states_[from * script_.robots + to];
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const double chance = uniform(state.rng);
  const double jitter_s = link.jitter_s * uniform(state.rng);
  state.counts.in.add(frame);
  const auto lose = [&](LinkLoss why) {
    state.counts.lost[static_cast<std::size_t>(why)].add(frame);
  };
  if (const auto why = loss_of(link, from, to, now_s)) return lose(*why);
  const auto dequeued_s = leave_queue(link, frame.size(), now_s, state.queue_end);
  if (!dequeued_s) return lose(LinkLoss::kQueue);
  if (chance < link.loss) return lose(LinkLoss::kChance);
  const double due_s = *dequeued_s + link.trace.delay_s(*dequeued_s) + jitter_s;
  in_flight_.emplace(due_s, SentFrame{from, to, now_s, due_s, frame});
}

std::optional<LinkLoss> LinkEmulator::loss_of(const LinkPlan& link, std::size_t from,
                                              std::size_t to, double now_s) const {
  const auto parts = [&](const LinkPartition& partition) {
    return partition.when.contains(now_s) && partition.group_of[from] != partition.group_of[to];
  };
  if (std::ranges::any_of(script_.partitions, parts)) return LinkLoss::kPartition;
  const auto is_now = [now_s](const RunSpan& span) { return span.contains(now_s); };
  if (std::ranges::any_of(link.outages, is_now)) return LinkLoss::kOutage;
  if (std::isfinite(link.range_m) &&
      (position(from, now_s) - position(to, now_s)).norm() > link.range_m)
    return LinkLoss::kRange;
  return std::nullopt;
}

Eigen::Vector3d LinkEmulator::position(std::size_t robot, double now_s) const {
  const std::vector<PathPoint>& path = script_.paths[robot];
  const Progress& progress = progress_[robot];
  const double time_s = progress.recorded_s + script_.rate * (now_s - progress.at_s);
  const auto after = std::ranges::upper_bound(path, time_s, {}, &PathPoint::time_s);
  if (after == path.begin()) return path.front().p_world;
  if (after == path.end()) return path.back().p_world;
  const PathPoint &a = *std::prev(after), &b = *after;
  const double share = (time_s - a.time_s) / (b.time_s - a.time_s);
  return a.p_world + share * (b.p_world - a.p_world);
}

std::vector<SentFrame> LinkEmulator::due(double now_s) {
  std::vector<SentFrame> deliveries;
  const auto end = in_flight_.upper_bound(now_s);
  for (auto it = in_flight_.begin(); it != end; ++it) {
    SentFrame& delivery = it->second;
    LinkCounts& counts = states_[delivery.from * script_.robots + delivery.to].counts;
    const double delay_s = now_s - delivery.sent_s;
    counts.delivered.add(delivery.frame);
    counts.delay_sum_s += delay_s;
    counts.delay_max_s = std::max(counts.delay_max_s, delay_s);
    deliveries.push_back(std::move(delivery));
  }
  in_flight_.erase(in_flight_.begin(), end);
  return deliveries;
}

std::optional<double> LinkEmulator::next_s() const {
  if (in_flight_.empty() || std::isinf(in_flight_.begin()->first)) return std::nullopt;
  return in_flight_.begin()->first;
}

const LinkCounts& LinkEmulator::counts(std::size_t from, std::size_t to) const {
  return states_.at(from * script_.robots + to).counts;
}

std::string links_csv(const LinkEmulator& emulator, const std::vector<std::string>& names) {
  std::ostringstream csv;
  csv << "from,to,frames_in,bytes_in,frames_delivered,bytes_delivered";
  for (const char* loss : kLinkLossNames) csv << ",frames_" << loss << ",bytes_" << loss;
  csv << ",delay_mean_s,delay_max_s\n";
  for (std::size_t from = 0; from < emulator.robots(); ++from)
    for (std::size_t to = 0; to < emulator.robots(); ++to) {
      if (from == to) continue;
      const LinkCounts& counts = emulator.counts(from, to);
      csv << names.at(from) << ',' << names.at(to);
      const auto add = [&csv](const FrameTally& tally) {
        csv << ',' << tally.frames << ',' << tally.bytes;
      };
      add(counts.in);
      add(counts.delivered);
      for (const FrameTally& lost : counts.lost) add(lost);
      if (counts.delivered.frames == 0)
        csv << ",,\n";
      else
        csv << ',' << counts.delay_sum_s / static_cast<double>(counts.delivered.frames) << ','
            << counts.delay_max_s << '\n';
    }
  return csv.str();
}

}  // namespace km
