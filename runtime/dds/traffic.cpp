#include "runtime/dds/traffic.hpp"

#include "modules/core/io/text_rows.hpp"

namespace km {
namespace {

// The only direction whose counts are present values; all others are cumulative.
constexpr const char* kWaiting = "waiting";

}  // namespace

std::uint64_t TrafficSnapshot::bytes(Direction direction, TrafficCategory category) const {
  std::uint64_t sum = 0;
  for (const PeerTraffic& row : peers)
    if (row.direction == direction && row.category == category)
      sum += row.count.bytes + row.retransmitted_bytes;
  return sum;
}

TrafficCsv::TrafficCsv(std::ostream& output, std::string_view former) : output_(output) {
  if (former.empty())
    output_ << "time_s,direction,topic,category,peer,messages,bytes,retransmitted_bytes\n";
  for (const TextRow& row : split_rows(former)) {
    constexpr std::size_t kSubject = 4;  // fields of a Subject, after the time
    Counts counts{};
    if (row.fields.size() != 1 + kSubject + counts.size()) continue;
    Subject subject(row.fields[1]);
    for (std::size_t i = 2; i <= kSubject; ++i) (subject += ',') += row.fields[i];
    for (std::size_t i = 0; i < counts.size(); ++i)
      counts[i] = static_cast<std::uint64_t>(parse_int64(row.fields[1 + kSubject + i]).value_or(0));
    written_[subject] = counts;
    if (row.fields[1] != kWaiting) former_[subject] = counts;
  }
  former_.erase("direction,topic,category,peer");
}

void TrafficCsv::append(double time_s, const TrafficSnapshot& snapshot) {
  for (const PeerTraffic& row : snapshot.peers)
    append(time_s, row.direction == Direction::kOut ? "out" : "in", row);
  for (const TopicTraffic& topic : snapshot.topics) {
    if (topic.direction == Direction::kIn) continue;
    const auto append_held = [&](const char* direction, const TrafficCount& count) {
      append(time_s, direction,
             {.topic = topic.topic, .category = topic.category, .peer = {}, .count = count});
    };
    append_held("delayed", topic.held.delayed);
    append_held(kWaiting, topic.held.waiting);
    append_held("superseded", topic.held.superseded);
    append_held("dropped", topic.held.dropped);
  }
}

void TrafficCsv::append(double time_s, const std::string& direction, const PeerTraffic& row) {
  const Subject subject = direction + ',' + row.topic + ',' + to_string(row.category) + ',' +
                          (row.peer ? std::to_string(*row.peer) : "*");
  Counts now{row.count.messages, row.count.bytes, row.retransmitted_bytes};
  const Counts& former = former_[subject];
  for (std::size_t i = 0; i < now.size(); ++i) now[i] += former[i];
  Counts& before = written_[subject];
  if (now == before) return;
  before = now;
  output_ << time_s << ',' << subject << ',' << now[0] << ',' << now[1] << ',' << now[2] << '\n';
}

}  // namespace km
