#include <catch2/catch.hpp>
#include <iostream>

#include "test/runtime/dds/peer_process.hpp"
#include "test/support/network.hpp"

namespace km {
namespace {

std::vector<std::string> discovery_settings(const std::string& discovery) {
  auto settings = own_team() + std::vector<std::string>{"discovery=" + discovery};
  if (discovery == "peers")
    settings.push_back("peers=[" + VirtualNetwork::address(1) + ", " + VirtualNetwork::address(2) +
                       ']');
  return settings;
}

struct Pair {
  Pair(VirtualNetwork& network, const std::vector<std::string>& settings)
      : a(start_peer(3, settings, network.host(1))), b(start_peer(4, settings, network.host(2))) {}

  std::unique_ptr<Process> a, b;
};

// The summary of a robot that quits: new messages, duplicates, missing.
std::vector<int> summary(Process& robot) {
  robot.send_line("quit");
  const auto line = robot.wait_for_prefix("summary ");
  REQUIRE(line);
  std::istringstream words(line->text.substr(8));
  std::vector<int> numbers(3);
  for (int& number : numbers) words >> number;
  return numbers;
}

TEST_CASE("Robots on two hosts discover each other, and an addressed message passes",
          "[dds][namespaces]") {
  if (!VirtualNetwork::available()) return;
  const std::string discovery = GENERATE("multicast", "peers");
  VirtualNetwork network(2);
  const Pair robots(network, discovery_settings(discovery));
  const auto a_sees = robots.a->wait_for("joined 4");
  const auto b_sees = robots.b->wait_for("joined 3");
  REQUIRE(a_sees);
  REQUIRE(b_sees);
  const double seconds = seconds_between(robots.b->started(), std::max(a_sees->time, b_sees->time));
  std::cout << "discovery by " << discovery << ", two hosts: " << seconds
            << " s from the launch of the second process\n";
  CHECK(seconds < kDiscoveryBound_s);
  robots.a->send_line("one 4 7");
  CHECK(robots.b->wait_for("one 3 7"));
}

TEST_CASE("On a host with several interfaces the robot uses the configured one",
          "[dds][namespaces]") {
  if (!VirtualNetwork::available()) return;
  VirtualNetwork network(2);
  for (const int host : {1, 2}) network.add_dead_interface(host);
  const Pair robots(network, own_team() + std::vector<std::string>{"interface=eth0"});
  CHECK(robots.a->wait_for("joined 4"));
  CHECK(robots.b->wait_for("joined 3"));
}

TEST_CASE("On a host with only loopback robots meet without configuration", "[dds][namespaces]") {
  if (!VirtualNetwork::available()) return;
  const std::string discovery = GENERATE("multicast", "peers");
  VirtualNetwork network(1);
  network.remove_interface(1);
  const auto settings = own_team() + std::vector<std::string>{"discovery=" + discovery};
  const auto a = start_peer(3, settings, network.host(1));
  const auto b = start_peer(4, settings, network.host(1));
  CHECK(a->wait_for("joined 4"));
  CHECK(b->wait_for("joined 3"));
}

TEST_CASE("Two robots without a link both receive a third", "[dds][namespaces]") {
  if (!VirtualNetwork::available()) return;
  VirtualNetwork network(3);
  network.set_link_between(1, 3, false);
  const auto settings = discovery_settings("multicast");
  const auto a = start_peer(3, settings, network.host(1));
  const auto b = start_peer(4, settings, network.host(2));
  const auto c = start_peer(5, settings, network.host(3));
  REQUIRE(a->wait_for("joined 4"));
  REQUIRE(b->wait_for("joined 3"));
  REQUIRE(b->wait_for("joined 5"));
  REQUIRE(c->wait_for("joined 4"));
  CHECK(a->lines("joined 5").empty());
  CHECK(c->lines("joined 3").empty());
  network.set_link_between(1, 3, true);
  CHECK(a->wait_for("joined 5"));
  CHECK(c->wait_for("joined 3"));
  network.set_link_between(1, 3, false);
  CHECK(a->wait_for("lost 5"));
  CHECK(c->wait_for("lost 3"));
  CHECK(b->lines("lost").empty());
}

TEST_CASE("A link that fails and returns loses no event", "[dds][namespaces]") {
  if (!VirtualNetwork::available()) return;
  const std::string discovery = GENERATE("multicast", "peers");
  VirtualNetwork network(2);
  const Pair robots(network, discovery_settings(discovery));
  REQUIRE(robots.a->wait_for("joined 4"));
  REQUIRE(robots.b->wait_for("joined 3"));
  robots.a->send_line("ping 0 49");
  REQUIRE(robots.b->wait_for("ping 3 49"));

  const auto cut = std::chrono::steady_clock::now();
  network.set_link(2, false);
  robots.a->send_line("ping 50 99");
  const auto lost = robots.b->wait_for("lost 3");
  REQUIRE(lost);
  REQUIRE(robots.a->wait_for("lost 4"));
  robots.a->send_line("ping 100 149");
  const auto plugged = std::chrono::steady_clock::now();
  network.set_link(2, true);
  const auto returned = robots.b->wait_for("returned 3");
  REQUIRE(returned);
  CHECK(robots.a->wait_for("returned 4"));
  CHECK(robots.b->wait_for("ping 3 149"));
  std::cout << "link cut, by " << discovery << ": lost after " << seconds_between(cut, lost->time)
            << " s, returned " << seconds_between(plugged, returned->time)
            << " s after it was plugged in\n";
  // The lease outlasted the outage: nothing is sent twice.
  CHECK(summary(*robots.b) == std::vector<int>{150, 0, 0});
}

TEST_CASE("An outage longer than the lease repeats the history, and duplicates are dropped",
          "[dds][namespaces]") {
  if (!VirtualNetwork::available()) return;
  VirtualNetwork network(2);
  const Pair robots(network, discovery_settings("multicast") +
                                 std::vector<std::string>{"lease_s=3", "liveliness_s=0.5"});
  REQUIRE(robots.a->wait_for("joined 4"));
  REQUIRE(robots.b->wait_for("joined 3"));
  robots.a->send_line("ping 0 49");
  REQUIRE(robots.b->wait_for("ping 3 49"));
  network.set_link(2, false);
  REQUIRE(robots.b->wait_for("lost 3"));
  robots.a->send_line("ping 50 99");
  // Outlasts the lease: the condition under test is time itself.
  std::this_thread::sleep_for(std::chrono::seconds(4));
  network.set_link(2, true);
  CHECK(robots.b->wait_for("returned 3"));
  CHECK(robots.b->wait_for("ping 3 99"));
  const auto numbers = summary(*robots.b);
  CHECK(numbers[0] == 100);
  CHECK(numbers[1] == 50);
  CHECK(numbers[2] == 0);
}

}  // namespace
}  // namespace km
