#include "runtime/dds/traffic.hpp"

namespace km {

std::uint64_t TrafficSnapshot::bytes(Direction direction, TrafficCategory category) const {
  std::uint64_t sum = 0;
  for (const PeerTraffic& row : peers)
    if (row.direction == direction && row.category == category)
      sum += row.count.bytes + row.retransmitted_bytes;
  return sum;
}

TrafficCsv::TrafficCsv(std::ostream& output) : output_(output) {
  output_ << "time_s,direction,topic,category,peer,messages,bytes,retransmitted_bytes\n";
}

void TrafficCsv::append(double time_s, const TrafficSnapshot& snapshot) {
  for (const PeerTraffic& row : snapshot.peers) {
    const std::tuple now(row.count.messages, row.count.bytes, row.retransmitted_bytes);
    auto& before = written_[{row.topic, row.direction, row.peer}];
    if (now == before) continue;
    before = now;
    output_ << time_s << (row.direction == Direction::kOut ? ",out," : ",in,") << row.topic << ','
            << to_string(row.category) << ',' << (row.peer ? std::to_string(*row.peer) : "*") << ','
            << row.count.messages << ',' << row.count.bytes << ',' << row.retransmitted_bytes
            << '\n';
  }
}

}  // namespace km
