#include <catch2/catch.hpp>
#include <sstream>

#include "runtime/dds/traffic.hpp"

namespace km {
namespace {

PeerTraffic row(Direction direction, std::optional<RobotId> peer, TrafficCount count,
                std::uint64_t retransmitted) {
  return {.topic = "bow",
          .category = TrafficCategory::kPlaceRecognition,
          .direction = direction,
          .peer = peer,
          .count = count,
          .retransmitted_bytes = retransmitted};
}

TEST_CASE("Traffic is written when it changes, cumulatively", "[traffic]") {
  std::ostringstream csv;
  TrafficCsv writer(csv);
  TrafficSnapshot snapshot;
  snapshot.peers = {row(Direction::kOut, 7, {1, 100}, 0), row(Direction::kIn, 7, {0, 0}, 0)};
  writer.append(1.0, snapshot);
  writer.append(2.0, snapshot);
  snapshot.peers[1].count = {2, 50};
  snapshot.peers.push_back(row(Direction::kOut, std::nullopt, {0, 0}, 30));
  writer.append(3.5, snapshot);
  CHECK(csv.str() ==
        "time_s,direction,topic,category,peer,messages,bytes,retransmitted_bytes\n"
        "1,out,bow,place_recognition,7,1,100,0\n"
        "3.5,in,bow,place_recognition,7,2,50,0\n"
        "3.5,out,bow,place_recognition,*,0,0,30\n");
}

TEST_CASE("Bytes add up per direction and category", "[traffic]") {
  TrafficSnapshot snapshot;
  snapshot.peers = {row(Direction::kOut, 7, {1, 100}, 5), row(Direction::kOut, 8, {1, 100}, 0),
                    row(Direction::kIn, 7, {1, 40}, 0)};
  CHECK(snapshot.bytes(Direction::kOut, TrafficCategory::kPlaceRecognition) == 205);
  CHECK(snapshot.bytes(Direction::kIn, TrafficCategory::kPlaceRecognition) == 40);
  CHECK(snapshot.bytes(Direction::kOut, TrafficCategory::kOther) == 0);
}

}  // namespace
}  // namespace km
