#include "runtime/dds/traffic.hpp"
#include "test/support/test.hpp"

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

TEST_CASE("Traffic is written when it changes, cumulatively") {
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

TEST_CASE("Traffic of a resumed run is added to the former traffic") {
  const std::string former =
      "time_s,direction,topic,category,peer,messages,bytes,retransmitted_bytes\n"
      "1,out,bow,place_recognition,7,1,100,0\n"
      "3.5,in,bow,place_recognition,7,2,50,0\n"
      "3.5,out,bow,place_recognition,*,0,0,30\n"
      "4,waiting,bow,place_recognition,*,9,900,0\n"
      "4,out,bow,place_recognition,7,2,200,10\n";
  std::ostringstream csv;
  TrafficCsv writer(csv, former);
  TrafficSnapshot snapshot;
  snapshot.peers = {row(Direction::kOut, 7, {0, 0}, 0), row(Direction::kIn, 7, {0, 0}, 0)};
  writer.append(5.0, snapshot);
  CHECK(csv.str().empty());
  snapshot.peers = {row(Direction::kOut, 7, {1, 40}, 0), row(Direction::kOut, 8, {1, 40}, 0),
                    row(Direction::kOut, std::nullopt, {0, 0}, 5)};
  writer.append(6.0, snapshot);
  CHECK(csv.str() ==
        "6,out,bow,place_recognition,7,3,240,10\n"
        "6,out,bow,place_recognition,8,1,40,0\n"
        "6,out,bow,place_recognition,*,0,0,35\n");

  snapshot = {};
  snapshot.topics = {
      {.topic = "bow",
       .category = TrafficCategory::kPlaceRecognition,
       .held = {.delayed = {}, .waiting = {1, 10}, .superseded = {}, .dropped = {}}}};
  csv.str({});
  writer.append(7.0, snapshot);
  CHECK(csv.str() == "7,waiting,bow,place_recognition,*,1,10,0\n");
}

TEST_CASE("Messages that a budget delays or drops are in the table beside those sent") {
  std::ostringstream csv;
  TrafficCsv writer(csv);
  const HeldBack held{
      .delayed = {1, 10}, .waiting = {2, 20}, .superseded = {3, 30}, .dropped = {4, 40}};
  TrafficSnapshot snapshot;
  snapshot.topics = {{.topic = "bow", .category = TrafficCategory::kPlaceRecognition, .held = held},
                     {.topic = "bow", .direction = Direction::kIn, .held = held}};
  writer.append(1.0, snapshot);
  snapshot.topics[0].held.waiting = {};
  writer.append(2.0, snapshot);
  CHECK(csv.str() ==
        "time_s,direction,topic,category,peer,messages,bytes,retransmitted_bytes\n"
        "1,delayed,bow,place_recognition,*,1,10,0\n"
        "1,waiting,bow,place_recognition,*,2,20,0\n"
        "1,superseded,bow,place_recognition,*,3,30,0\n"
        "1,dropped,bow,place_recognition,*,4,40,0\n"
        "2,waiting,bow,place_recognition,*,0,0,0\n");
}

}  // namespace
}  // namespace km
