#include "test/runtime/dds/peer_process.hpp"
#include "test/support/forged_discovery.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::vector<std::string> kOnLoopback{"interface=lo", "spdp_interval_s=0.2"};

TEST_CASE("Robots with keys return after a forged packet has declared that they are gone") {
  const auto settings = own_team() + kOnLoopback;
  const TeamOfTwo keys;
  const auto a = start_peer(3, settings, 0, keys.of(3));
  const auto b = start_peer(4, settings, 0, keys.of(4));
  REQUIRE(a->wait_for("joined 4"));
  REQUIRE(b->wait_for("joined 3"));
  a->send_line("ping 0 49");
  ForgedDiscovery stranger(loopback_config().domain);
  stranger.record(3);
  stranger.dispose(3);
  REQUIRE(b->wait_for("left 3"));
  a->send_line("ping 50 99");
  CHECK(b->wait_for("returned 3"));
  CHECK(b->wait_for("ping 3 99"));
  b->send_line("one 3 7");
  CHECK(a->wait_for("one 4 7"));
}

TEST_CASE("Robots meet after forged packets have replaced the announcement of one of them") {
  const auto settings = own_team() + kOnLoopback;
  const TeamOfTwo keys;
  using enum ForgedDiscovery::Change;
  const auto [has_keys, change] = GENERATE(table<bool, ForgedDiscovery::Change>(
      {{true, kUserData}, {false, kUserData}, {true, kAddresses}}));
  CAPTURE(has_keys, change);
  const auto start = [&, has_keys = has_keys](RobotId id) {
    return start_peer(id, settings, 0, has_keys ? keys.of(id) : fs::path());
  };
  const auto a = start(3);
  ForgedDiscovery stranger(loopback_config().domain);
  stranger.record(3);
  std::jthread forger([&, change = change](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      stranger.contradict(3, change);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  const auto b = start(4);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  forger.request_stop();
  forger.join();
  CHECK(b->wait_for("joined 3"));
  if (change == kUserData) CHECK(b->wait_for("refused 3"));
  CHECK(a->wait_for("joined 4"));
  a->send_line("ping 0 9");
  CHECK(b->wait_for("ping 3 9"));
}

TEST_CASE("Robots meet although a program has announced more participants than they remember") {
  const auto settings = own_team() + kOnLoopback;
  const TeamOfTwo keys;
  const auto a = start_peer(3, settings, 0, keys.of(3));
  ForgedDiscovery stranger(loopback_config().domain);
  stranger.record(3);
  // Packets are lost if the robot is busy. It refuses each participant that copies its own keys.
  for (std::size_t refused = 0; refused < PeerTable::kMaxParticipants;) {
    stranger.invent(3, 50);
    REQUIRE(a->wait_for("refused 3", refused + 1));
    refused = a->lines("refused 3").size();
  }
  // The announcement of a robot is discarded before its statuses arrive, and read again.
  std::jthread inventor([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      stranger.invent(3, 10);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  const auto b = start_peer(4, settings, 0, keys.of(4));
  std::this_thread::sleep_for(std::chrono::seconds(3));
  inventor.request_stop();
  inventor.join();
  CHECK(a->wait_for("joined 4"));
  CHECK(b->wait_for("joined 3"));
}

TEST_CASE("Messages of a restarted robot wait until its former process counts as lost") {
  const auto settings = own_team() + std::vector<std::string>{"interface=lo", "liveliness_s=11"};
  const auto a = start_peer(3, settings);
  auto b = start_peer(4, settings);
  REQUIRE(a->wait_for("joined 4"));
  b->kill(SIGKILL);
  b->wait();
  b = start_peer(4, settings);
  b->send_line("ping 0 9");
  CHECK(a->wait_for("restarted 4"));
  CHECK(a->wait_for("ping 4 9", 1, std::chrono::seconds(9)));
}

TEST_CASE("Teams in one domain do not see each other") {
  const auto team = own_team() + kOnLoopback;
  const auto a = start_peer(3, team);
  const auto other = start_peer(5, team + std::vector<std::string>{"team=other"});
  const auto b = start_peer(4, team);
  REQUIRE(a->wait_for("joined 4"));
  REQUIRE(b->wait_for("joined 3"));
  CHECK(a->lines("joined 5").empty());
  CHECK(other->lines().empty());
}

}  // namespace
}  // namespace km
