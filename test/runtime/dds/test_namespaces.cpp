#include "test/runtime/dds/peer_process.hpp"
#include "test/support/command.hpp"
#include "test/support/network.hpp"
#include "test/support/test.hpp"

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
  Pair(const VirtualNetwork& network, const std::vector<std::string>& settings,
       std::unique_ptr<TeamOfTwo> team_keys = nullptr)
      : keys(std::move(team_keys)),
        a(start(network, 1, settings)),
        b(start(network, 2, settings)) {}

  [[nodiscard]] bool have_met() const { return a->wait_for("joined 4") && b->wait_for("joined 3"); }

  std::unique_ptr<TeamOfTwo> keys;  // null: the team has none
  std::unique_ptr<Process> a, b;

 private:
  [[nodiscard]] std::unique_ptr<Process> start(const VirtualNetwork& network, int host,
                                               const std::vector<std::string>& settings) const {
    const auto robot = static_cast<RobotId>(2 + host);
    return start_peer(robot, settings, network.host(host), keys ? keys->of(robot) : fs::path());
  }
};

// Number of packets that the kernel split into fragments.
long packets_split_by(pid_t host) {
  std::ifstream file("/proc/" + std::to_string(host) + "/net/snmp");
  std::string names, values, name;
  std::getline(file, names);
  std::getline(file, values);
  std::istringstream columns(names), numbers(values);
  for (std::string value; columns >> name && numbers >> value;)
    if (name == "FragCreates") return std::stol(value);
  return -1;
}

// The summary of a robot that quits: new messages, duplicates.
std::vector<int> summary(Process& robot) {
  robot.send_line("quit");
  const auto line = robot.wait_for_prefix("summary ");
  REQUIRE(line);
  std::istringstream words(line->text.substr(8));
  std::vector<int> numbers(2);
  for (int& number : numbers) words >> number;
  return numbers;
}

TEST_CASE("On a host with several interfaces the robot uses the configured one") {
  if (!VirtualNetwork::available()) return;
  VirtualNetwork network(2);
  for (const int host : {1, 2}) network.add_dead_interface(host);
  const Pair robots(network, own_team() + std::vector<std::string>{"interface=eth0"});
  CHECK(robots.have_met());
}

TEST_CASE("Without configuration a robot uses the interface with a carrier, and moves to it") {
  if (!VirtualNetwork::available()) return;
  const bool is_late = GENERATE(false, true);  // the cable is connected after the start
  CAPTURE(is_late);
  VirtualNetwork network(2);
  network.remove_interface(1);
  network.add_dead_interface(1);  // comes first in the kernel's order
  network.add_interface(1);
  network.set_address(1, VirtualNetwork::address(1) + "/24");
  if (is_late) network.set_link(1, false);
  const Pair robots(network, own_team());
  if (is_late) {
    robots.a->send_line("ping 0 1");
    std::this_thread::sleep_for(std::chrono::seconds(2));  // the condition is time itself
    network.set_link(1, true);
  }
  CHECK(robots.have_met());
}

TEST_CASE("A robot that is received but does not receive this one is unmet, with the cause") {
  if (!VirtualNetwork::available()) return;
  const VirtualNetwork network(2);
  // Only its multicast leaves host 1, and nothing arrives from host 2.
  const std::string route = "ip route add blackhole " + VirtualNetwork::address(2);
  REQUIRE(Process(words_of(route), network.host(1)).wait() == 0);
  const Pair robots(network, own_team());
  robots.b->send_line("unmet");
  const auto line = robots.b->wait_for_prefix("unmet ");
  REQUIRE(line);
  CHECK_THAT(line->text, Contains("robot3 (id 3): ") && Contains("firewall"));
}

TEST_CASE("Large messages pass a network that drops fragments of packets") {
  if (!VirtualNetwork::available()) return;
  VirtualNetwork network(2);
  for (const int host : {1, 2}) {
    network.set_path_mtu(host, 1280);
    REQUIRE(Process({"ip", "link", "set", "eth0", "mtu", "1280"}, network.host(host)).wait() == 0);
  }
  const Pair robots(network, own_team(), std::make_unique<TeamOfTwo>());
  REQUIRE(robots.a->wait_for("joined 4"));
  robots.a->send_line("large 7");
  CHECK(robots.b->wait_for("ping 3 7"));
  CHECK(packets_split_by(network.host(1)) == 0);
}

TEST_CASE("On a host with only loopback robots meet without configuration") {
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

TEST_CASE("A link that fails and returns loses no event") {
  if (!VirtualNetwork::available()) return;
  const std::string discovery = GENERATE("multicast", "peers");
  VirtualNetwork network(2);
  const Pair robots(network, discovery_settings(discovery));
  REQUIRE(robots.have_met());
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
  CHECK(summary(*robots.b) == std::vector<int>{150, 0});
}

// Both robots send `first` to `last` to all and the last number to each other.
void exchange(const Pair& robots, int first, int last) {
  const std::string range = std::to_string(first) + ' ' + std::to_string(last);
  robots.a->send_line("ping " + range);
  robots.b->send_line("ping " + range);
  robots.a->send_line("one 4 " + std::to_string(last));
  robots.b->send_line("one 3 " + std::to_string(last));
}

void check_received(const Pair& robots, int last, const std::vector<std::string>& kinds) {
  for (const std::string& what : kinds) {
    CHECK(robots.a->wait_for(what + " 4 " + std::to_string(last)));
    CHECK(robots.b->wait_for(what + " 3 " + std::to_string(last)));
  }
}

void check_received(const Pair& robots, int last) {
  check_received(robots, last, {"ping", "one"});
}

TEST_CASE("A robot whose own address changes returns to its team, and nothing is lost") {
  if (!VirtualNetwork::available()) return;
  const std::string discovery = GENERATE("multicast", "peers");
  const std::string address = GENERATE("10.77.0.102/24", "10.78.0.2/24");
  const bool has_keys = (discovery == "multicast") == (address == "10.77.0.102/24");
  CAPTURE(discovery, address, has_keys);
  VirtualNetwork network(2);
  network.set_address(1, VirtualNetwork::address(1) + "/24");
  const Pair robots(network, discovery_settings(discovery),
                    has_keys ? std::make_unique<TeamOfTwo>() : nullptr);
  REQUIRE(robots.have_met());
  exchange(robots, 0, 49);
  check_received(robots, 49);

  network.set_address(2, "");
  exchange(robots, 50, 99);
  network.set_address(2, address);
  const auto changed = std::chrono::steady_clock::now();
  const auto a_sees = robots.a->wait_for("returned 4");
  const auto b_sees = robots.b->wait_for("returned 3");
  REQUIRE(a_sees);
  REQUIRE(b_sees);
  const double seconds = seconds_between(changed, std::max(a_sees->time, b_sees->time));
  std::cout << "new address, by " << discovery << ": back after " << seconds << " s\n";
  // With keys the requests of the outage are lost. Events are sealed and numbered again, so that
  // they arrive twice.
  if (has_keys)
    check_received(robots, 99, {"ping"});
  else
    check_received(robots, 99);
  exchange(robots, 100, 149);
  check_received(robots, 149);
  for (Process* robot : {robots.a.get(), robots.b.get()}) {
    const auto numbers = summary(*robot);
    CHECK(numbers[0] >= 150);
    CHECK((has_keys || numbers[0] == 150));
    CHECK(robot->wait() == 0);
  }
}

TEST_CASE("A robot waits for an interface that is not up, and for one that has gone") {
  if (!VirtualNetwork::available()) return;
  const std::vector<std::string> interface =
      GENERATE(std::vector<std::string>{"interface=eth0"}, std::vector<std::string>());
  const bool is_removed = GENERATE(true, false);  // or only without an address
  CAPTURE(interface, is_removed);
  VirtualNetwork network(2);
  const auto take_away = [&] {
    if (is_removed) return network.remove_interface(2);
    network.set_address(2, "");
  };
  const auto give_back = [&] {
    if (is_removed) network.add_interface(2);
    network.set_address(2, VirtualNetwork::address(2) + "/24");
    return std::chrono::steady_clock::now();
  };
  take_away();
  const Pair robots(network, own_team() + interface);
  robots.b->send_line("ping 0 49");
  CHECK(robots.b->lines("joined").empty());
  const auto up = give_back();
  const auto joined = robots.a->wait_for("joined 4");
  REQUIRE(joined);
  REQUIRE(robots.b->wait_for("joined 3"));
  CHECK(robots.a->wait_for("ping 4 49"));
  take_away();
  REQUIRE(robots.a->wait_for("lost 4"));
  exchange(robots, 50, 99);
  const auto up_again = give_back();
  const auto returned = robots.a->wait_for("returned 4");
  REQUIRE(returned);
  REQUIRE(robots.b->wait_for("returned 3"));
  std::cout << "interface: joined after " << seconds_between(up, joined->time) << " s, back after "
            << seconds_between(up_again, returned->time) << " s\n";
  check_received(robots, 99);
  CHECK(summary(*robots.a) == std::vector<int>{100, 0});
  CHECK(summary(*robots.b)[0] == 50);
}

TEST_CASE(
    "With keys an outage longer than the lease repeats the history, and duplicates are dropped") {
  if (!VirtualNetwork::available()) return;
  VirtualNetwork network(2);
  const Pair robots(
      network,
      discovery_settings("multicast") + std::vector<std::string>{"lease_s=3", "liveliness_s=0.5"},
      std::make_unique<TeamOfTwo>());
  REQUIRE(robots.have_met());
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
}

}  // namespace
}  // namespace km
