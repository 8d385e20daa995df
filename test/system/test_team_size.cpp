#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <set>
#include <string>

#include "test/support/network.hpp"
#include "test/support/process.hpp"
#include "test/support/random_team.hpp"
#include "test/system/team_run.hpp"

// Cost of a team by its size: 2, 4, ... robots, a process each, on one host with a network of its
// own that carries only their bytes.

namespace km {
namespace {

namespace fs = std::filesystem;

// Each robot has closures with the two after it, in a ring.
SplitGraph ring_of(int robots) {
  std::vector<RobotId> ids;
  std::vector<std::pair<RobotId, RobotId>> pairs;
  for (int k = 0; k < robots; ++k) {
    ids.push_back(static_cast<RobotId>(k));
    for (const int step : {1, 2}) {
      const std::pair ends = std::minmax({k, (k + step) % robots});
      const std::pair pair{static_cast<RobotId>(ends.first), static_cast<RobotId>(ends.second)};
      if (pair.first != pair.second && std::find(pairs.begin(), pairs.end(), pair) == pairs.end())
        pairs.push_back(pair);
    }
  }
  return random_team(24, ids, 40, pairs);
}

// Time of day at the begin of a line of a log [s].
double time_of(const std::string& line) {
  int hours = 0, minutes = 0;
  double seconds = 0.0;
  REQUIRE(std::sscanf(line.c_str(), "%d:%d:%lf", &hours, &minutes, &seconds) == 3);
  return 3600.0 * hours + 60.0 * minutes + seconds;
}

// From a robot's first line about the network to the last of its peers.
struct Discovery {
  std::set<std::string> peers = {};  // names
  double seconds = 0.0;
};

Discovery discovery_in(const fs::path& log) {
  std::ifstream in(log);
  std::optional<double> start;
  Discovery result;
  for (std::string line; std::getline(in, line);) {
    if (!start && line.find(" dds: ") != line.npos) start = time_of(line);
    if (line.find(" peers: ") == line.npos || line.find(" joined from ") == line.npos) continue;
    REQUIRE(start);
    const std::size_t name = line.find(" peers: ") + std::string(" peers: ").size();
    result.peers.insert(line.substr(name, line.find(' ', name) - name));
    constexpr double kDay_s = 86400.0;
    result.seconds = std::fmod(time_of(line) - *start + kDay_s, kDay_s);
  }
  return result;
}

// Bytes sent by the interfaces of a network, headers included.
double bytes_on_the_wire(pid_t network_of) {
  Process ip({"ip", "-s", "-j", "link"}, network_of);
  const std::optional<TimedLine> links = ip.wait_for_prefix("[");
  REQUIRE(links);
  double bytes = 0.0;
  for (const auto& link : Json::parse(links->text))
    bytes += link["stats64"]["tx"]["bytes"].get<double>();
  return bytes;
}

struct Growth {
  int robots = 0;
  double discovery_s = 0.0;    // time of the slowest robot
  double wire_bytes = 0.0;     // per robot
  double counted_bytes = 0.0;  // per robot by traffic.csv: without discovery and transport
  double cpu_s = 0.0;          // per robot
  double peak_memory_bytes = 0.0;
  double seconds = 0.0;  // time of the slowest robot
};

Growth measure(int robots) {
  const TemporaryFolder folder;
  const fs::path team = write_team(ring_of(robots), folder);
  const VirtualNetwork network(1);
  Process run(words_of(KM_BIN_DIR "/kimera_multi_team --config " + team.string() +
                       " --rate max --output " + folder.path().string() + " --domain " +
                       std::to_string(random_domain()) + " -- --serve-limit 1000"),
              network.host(1));
  CHECK(run.wait() == 0);
  Growth result{.robots = robots, .wire_bytes = bytes_on_the_wire(network.host(1)) / robots};
  for (int k = 0; k < robots; ++k) {
    CAPTURE(robots, k);
    const RunSummary summary = read_summary(folder.path() / robot_name(k) / "summary.json");
    CHECK(summary.pgo.members.size() == static_cast<std::size_t>(robots));
    CHECK(summary.pgo.settled);
    const Discovery discovery = discovery_in(folder.path() / robot_name(k) / "robot.log");
    std::set<std::string> others;
    for (int other = 0; other < robots; ++other)
      if (other != k) others.insert(robot_name(other));
    CHECK(discovery.peers == others);
    result.discovery_s = std::max(result.discovery_s, discovery.seconds);
    for (const auto& [category, bytes] : summary.traffic)
      result.counted_bytes += static_cast<double>(bytes) / robots;
    result.cpu_s += summary.process.cpu_s / robots;
    result.peak_memory_bytes =
        std::max(result.peak_memory_bytes, static_cast<double>(summary.process.peak_memory_bytes));
    result.seconds = std::max(result.seconds, summary.seconds);
  }
  return result;
}

// KM_ROBOTS=32 tests up to 32 robots.
TEST_CASE("A team grows and all its robots find each other", "[system][namespaces][team_size]") {
  if (!VirtualNetwork::available()) return;
  const char* most = std::getenv("KM_ROBOTS");
  std::puts(
      "robots, discovery [s], on the wire [kB a robot], counted [kB a robot], CPU [s a robot], "
      "peak memory [MB], run [s]");
  const int largest = most != nullptr ? std::atoi(most) : 4;
  REQUIRE(largest >= 2);
  for (int robots = 2; robots <= largest; robots *= 2) {
    const Growth growth = measure(robots);
    // Discovery, headers and acknowledgements are additional: measured 1.6 to 1.9 times as much.
    CHECK(growth.wire_bytes > growth.counted_bytes);
    CHECK(growth.wire_bytes < 4.0 * growth.counted_bytes);
    std::printf("%d, %.2f, %.0f, %.0f, %.2f, %.0f, %.1f\n", growth.robots, growth.discovery_s,
                growth.wire_bytes / 1e3, growth.counted_bytes / 1e3, growth.cpu_s,
                growth.peak_memory_bytes / 1e6, growth.seconds);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace km
