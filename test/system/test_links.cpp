#include "modules/core/config.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/network.hpp"
#include "test/support/process.hpp"
#include "test/support/random_team.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"
#include "test/system/team_run.hpp"

// Teams on recorded pose graphs: a process for each robot, in one network, and in separate networks
// if some robots do not receive each other.

namespace km {
namespace {

using Links = std::vector<std::pair<int, int>>;

Links all_links(int robots) {
  Links links;
  for (int a = 0; a < robots; ++a)
    for (int b = a + 1; b < robots; ++b) links.emplace_back(a, b);
  return links;
}

// A team on hosts connected by `links`; robot k is on host k + 1.
class Team {
 public:
  // `path_mtu`: larger packets do not reach any robot; 0: all do.
  Team(const SplitGraph& graph, const Links& links, const fs::path& folder, std::string method,
       double settle_s = 3.0, int path_mtu = 0)
      : network_(static_cast<int>(graph.keyframes.size())),
        folder_(folder),
        method_(std::move(method)),
        settle_s_(settle_s) {
    const int robots = static_cast<int>(graph.keyframes.size());
    for (const auto& [a, b] : all_links(robots))
      if (std::find(links.begin(), links.end(), std::pair(a, b)) == links.end())
        network_.set_link_between(a + 1, b + 1, false);
    for (int host = 1; path_mtu > 0 && host <= robots; ++host)
      network_.set_path_mtu(host, path_mtu);
    const int domain = random_domain();
    for (int k = 0; k < robots; ++k) {
      write_part(graph, static_cast<RobotId>(k), folder_);
      robots_.push_back(std::make_unique<Process>(command(k, domain), network_.host(k + 1)));
    }
  }

  // True once every robot reports that it optimises with all others.
  bool is_joint() {
    const std::string with_all = ", with " + std::to_string(robots_.size() - 1);
    return std::all_of(robots_.begin(), robots_.end(), [&](const auto& robot) {
      return robot->wait_until([&](const auto& line) { return line.find(with_all) != line.npos; })
          .has_value();
    });
  }

  // Disconnects robot k from all others.
  void cut_off(int k) { network_.set_link(k + 1, false); }

  void take_addresses() {
    for (int host = 1; host <= static_cast<int>(robots_.size()); ++host)
      network_.set_address(host, "");
  }

  void interrupt() {
    for (const auto& robot : robots_) robot->kill(SIGTERM);
  }

  // Exit codes of all robots.
  std::vector<int> wait() {
    std::vector<int> codes;
    for (const auto& robot : robots_) codes.push_back(robot->wait());
    return codes;
  }

 private:
  [[nodiscard]] std::vector<std::string> command(int k, int domain) const {
    const std::string number = std::to_string(k);
    const std::string settings =
        " --set pose_graph.method=" + method_ + " --set run.settle_s=" + shortest_text(settle_s_);
    return words_of(KM_BIN_DIR "/kimera_multi_robot --robot " + number + " --name " +
                    robot_name(k) + " --graph " + (folder_ / ("part" + number + ".g2o")).string() +
                    " --rate max --output " + (folder_ / robot_name(k)).string() + " --domain " +
                    std::to_string(domain) + " --interface eth0 --log warn" + settings);
  }

  VirtualNetwork network_;
  fs::path folder_;
  std::string method_;
  double settle_s_;
  std::vector<std::unique_ptr<Process>> robots_;
};

struct Solved {
  double cost = 0.0;
  double one = 0.0;  // cost of one process
  std::size_t edges = 0;
  double slowest_s = 0.0;
};

// A team that runs from its construction on. Several of them at a time take no longer than one,
// because robots mostly wait for each other.
class Solution {
 public:
  Solution(const SplitGraph& graph, const Links& links, const std::string& method = "newton")
      : robots_(static_cast<int>(graph.keyframes.size())),
        team_(graph, links, folder_.path(), method) {}

  // Waits for the end of all robots.
  Solved get() {
    const auto codes = team_.wait();
    CHECK(codes == std::vector<int>(codes.size(), 0));
    Solved solved;
    for (int k = 0; k < robots_; ++k) {
      CAPTURE(k);
      const RunSummary summary = read_summary(folder_.path() / robot_name(k) / "summary.json");
      CHECK(summary.pgo.members.size() == static_cast<std::size_t>(robots_));
      CHECK(summary.pgo.settled);
      CHECK(summary.exit_reason == "all present robots have settled");
      solved.slowest_s = std::max(solved.slowest_s, summary.seconds);
    }
    const TeamResult team = read_team(folder_.path(), robots_);
    solved.edges = team.graph.edges.size();
    solved.cost = cost_of(team.graph, team.poses);
    solved.one = solved_in_one_process(folder_.path(), robots_);
    return solved;
  }

 private:
  TemporaryFolder folder_;
  int robots_;
  Team team_;
};

std::ostream& operator<<(std::ostream& out, const Solved& solved) {
  return out << "cost " << solved.cost << " of " << solved.edges << " edges, "
             << std::abs(solved.cost - solved.one) / solved.one << " of it from one process, "
             << solved.slowest_s << " s";
}

constexpr double kSame = 1e-9;  // relative difference of costs

TEST_CASE("A chain of five robots reaches the cost of five that all receive each other",
          "[namespaces]") {
  if (!VirtualNetwork::available()) return;
  const Links chain{{0, 1}, {1, 2}, {2, 3}, {3, 4}};
  const SplitGraph graph = random_team(20, {0, 1, 2, 3, 4}, 40, {{0, 1}, {1, 2}, {2, 3}, {3, 4}});
  Solution in_chain(graph, chain), with_all_links(graph, all_links(5));
  const Solved some = in_chain.get(), all = with_all_links.get();
  std::cout << "chain of five: " << some << "; with all links: " << all << '\n';
  CHECK(some.edges == all.edges);
  CHECK(some.cost == Approx(all.cost).epsilon(kSame).margin(0.0));
  CHECK(some.cost == Approx(some.one).epsilon(kSame).margin(0.0));
  CHECK(all.cost == Approx(all.one).epsilon(kSame).margin(0.0));
}

TEST_CASE("A robot that some robots do not receive joins, with rbcd as the solver, too",
          "[namespaces]") {
  if (!VirtualNetwork::available()) return;
  const SplitGraph graph = random_team(21, {0, 1, 2}, 40, {{0, 1}, {1, 2}});
  const Solved cut = Solution(graph, {{0, 1}, {1, 2}}, "rbcd").get();
  std::cout << "link 1-3 cut, rbcd: " << cut << '\n';
  CHECK(cut.edges == graph.odometry.size() + graph.closures.size());
  CHECK(cut.cost == Approx(cut.one).epsilon(1e-4));  // rbcd stops when it has become slow
}

TEST_CASE("Robots with a budget come to one frame and send no more than that") {
  const SplitGraph graph = random_team(22, {0, 1}, 40, {{0, 1}});
  const TemporaryFolder folder;
  constexpr double kRate = 3000.0;
  const TeamRun run = run_team(write_team(graph, folder), folder.path(), folder, {},
                               "--set budget.bytes_per_s=" + std::to_string(kRate));
  CAPTURE(run.result.output);
  REQUIRE(run.result.exit_code == 0);
  for (const int robot : {0, 1}) {
    const RunSummary summary = read_summary(folder.path() / robot_name(robot) / "summary.json");
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1});
    CHECK(summary.pgo.settled);
    CHECK(summary.exit_reason == "all present robots have settled");
    REQUIRE(summary.held_back);
    CHECK(summary.held_back->delayed.messages.at("pgo") > 0);
    CHECK(summary.held_back->dropped.bytes.at("pgo") == 0);
    double bytes = 0.0;
    for (const auto& [category, sent] : summary.traffic) bytes += static_cast<double>(sent);
    std::cout << "budget of " << kRate << " B/s: sent " << bytes << " B in " << summary.seconds
              << " s\n";
    CHECK(bytes < 1.05 * kRate * summary.seconds);
  }
}

TEST_CASE("Robots whose addresses have gone end on a signal", "[namespaces]") {
  if (!VirtualNetwork::available()) return;
  const SplitGraph graph = random_team(24, {0, 1}, 40, {{0, 1}});
  const TemporaryFolder folder;
  constexpr double kSettle_s = 600.0;  // the signal ends them
  Team team(graph, all_links(2), folder.path(), "newton", kSettle_s);
  REQUIRE(team.is_joint());
  team.take_addresses();
  team.interrupt();
  CHECK(team.wait() == std::vector<int>{0, 0});
  for (const int robot : {0, 1})
    CHECK(read_summary(folder.path() / robot_name(robot) / "summary.json").keyframes == 40);
}

TEST_CASE("A team that splits in two ends, and both sides report the robots they waited for",
          "[namespaces]") {
  if (!VirtualNetwork::available()) return;
  const SplitGraph graph = random_team(21, {0, 1, 2}, 40, {{0, 1}, {1, 2}});
  const TemporaryFolder folder;
  constexpr double kSettle_s = 20.0;  // they are cut apart before
  Team team(graph, {{0, 1}, {1, 2}}, folder.path(), "newton", kSettle_s);
  REQUIRE(team.is_joint());
  team.cut_off(2);
  CHECK(team.wait() == std::vector<int>{0, 0, 0});
  // Robots 0 and 2 know of each other only through robot 1, which may not have sent their names.
  const std::map<int, std::vector<std::string>> missed{
      {0, {"robot ?2"}}, {1, {"robot2"}}, {2, {"robot ?0", "robot1"}}};
  for (const auto& [robot, names] : missed) {
    const RunSummary summary = read_summary(folder.path() / robot_name(robot) / "summary.json");
    CAPTURE(robot, summary.exit_reason);
    CHECK_THAT(summary.exit_reason, StartsWith("settled without "));
    CHECK(summary.lost_peers.size() == names.size());
    CHECK(summary.apart_peers.empty());
    for (const std::string& name : names)
      CHECK_THAT(summary.exit_reason, Matches(".*" + name + " \\(not received for .*"));
    for (const auto& [name, missed_s] : summary.lost_peers) CHECK(missed_s > 0.0);
  }
}

TEST_CASE("A path that drops large packets is a finding of the run with their size",
          "[namespaces]") {
  if (!VirtualNetwork::available()) return;
  // 1000 closures: the messages on them are large.
  const SplitGraph graph =
      random_team(23, {0, 1}, 200, std::vector<std::pair<RobotId, RobotId>>(125, {0, 1}));
  const TemporaryFolder folder;
  Team team(graph, {{0, 1}}, folder.path(), "newton --serve-limit 15", 3.0, 1000);
  CHECK(team.wait() == std::vector<int>{0, 0});
  const RunSummary summary = read_summary(folder.path() / robot_name(0) / "summary.json");
  CHECK(summary.pgo.members.size() < 2);
  const auto found = std::ranges::find(summary.findings, "network.path_mtu", &Finding::id);
  REQUIRE(found != summary.findings.end());
  CHECK_THAT(found->what,
             Contains("answers packets of up to 9") || Contains("answers packets of up to 1000 B"));
}

// Bytes sent by the interfaces of a host, headers included.
double bytes_on_the_wire(pid_t host) {
  Process ip({"ip", "-s", "-j", "link"}, host);
  const std::optional<TimedLine> links = ip.wait_for_prefix("[");
  REQUIRE(links);
  double bytes = 0.0;
  for (const auto& link : Json::parse(links->text))
    bytes += link["stats64"]["tx"]["bytes"].get<double>();
  return bytes;
}

// On a host of their own, whose network carries only their bytes.
TEST_CASE("Five processes over DDS reach the cost that one process reaches", "[namespaces]") {
  if (!VirtualNetwork::available()) return;
  const SplitGraph graph =
      random_team(20, {0, 1, 2, 3, 4}, 40, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {0, 4}, {1, 3}});
  constexpr int kRobots = 5;
  const TemporaryFolder folder;
  const VirtualNetwork network(1);
  const fs::path json = folder.path() / "team.json";
  Process run(
      words_of(KM_BIN_DIR "/kimera_multi_team --config " + write_team(graph, folder).string() +
               " --rate max --output " + folder.path().string() + " --json " + json.string() +
               " --domain " + std::to_string(random_domain()) + " -- --serve-limit 1000"),
      network.host(1));
  REQUIRE(run.wait() == 0);
  const Json results = read_json(json);
  double counted = 0.0;  // bytes by traffic.csv: without discovery, headers and acknowledgements
  for (RobotId k = 0; k < kRobots; ++k) {
    CAPTURE(k);
    const fs::path file = folder.path() / robot_name(k) / "summary.json";
    const RunSummary summary = read_summary(file);
    const Json own = summary;
    CHECK(own == read_json(file));  // all that it says is read, nothing else is in it
    CHECK(summary.robot == k);
    CHECK(summary.name == robot_name(k));
    CHECK(summary.keyframes == 40);
    CHECK(summary.closures.inliers > 0);
    CHECK(summary.closures.inliers <= summary.closures.verified);
    CHECK(summary.closures.verified <= summary.closures.candidates);
    CHECK(summary.pgo.round > 0);
    CHECK(summary.pgo.anchor == RobotId{0});
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1, 2, 3, 4});
    CHECK(summary.pgo.settled);
    CHECK(summary.traffic.at("pgo") > 0);
    CHECK(summary.process.cpu_s > 0.0);
    CHECK(summary.process.peak_memory_bytes > 1'000'000);
    CHECK(summary.seconds > 0.0);
    CHECK(summary.exit_reason == "all present robots have settled");
    for (const auto& [key, value] : own.items()) CHECK(results["robots"][k][key] == value);
    for (const auto& [category, bytes] : summary.traffic) counted += static_cast<double>(bytes);
  }
  const double wire = bytes_on_the_wire(network.host(1));
  CAPTURE(wire, counted);
  CHECK(wire > counted);
  CHECK(wire < 4.0 * counted);  // measured with four robots: 1.6 to 1.9 times as much

  const TeamResult team = read_team(folder.path(), kRobots);
  CHECK(team.poses.size() == 5 * 40);
  CHECK(team.graph.edges.size() >= 5 * 39 + 4 * 3);  // connected by sets of three or more
  const double many = cost_of(team.graph, team.poses);
  const double one = solved_in_one_process(folder.path(), kRobots);
  const double difference = std::abs(many - one) / one;
  std::cout << "five processes: cost " << many << ", one process " << one << ", apart by "
            << difference << " of it; " << wire / counted << " bytes for each byte of messages\n";
  CHECK(difference < 1e-9);
}

// The largest distance between equal poses of two teams, relative to the first pose of each.
double largest_distance_m(const std::vector<StampedPose>& one,
                          const std::vector<StampedPose>& other) {
  REQUIRE(one.size() == other.size());
  const SE3 T_other_one = other.front().T * one.front().T.inverse();
  double largest_m = 0.0;
  for (std::size_t k = 0; k < one.size(); ++k)
    largest_m = std::max(largest_m,
                         (T_other_one * one[k].T.translation() - other[k].T.translation()).norm());
  return largest_m;
}

TEST_CASE("Eight processes over DDS end with the poses of `kimera_multi_pgo solve`") {
  const auto dataset = shared_data("multi_robot/tunnels_8robots");
  if (!dataset) return;
  constexpr int kRobots = 8;
  const TemporaryFolder folder;
  // By default the last session waits until the bytes of the first ones are paid.
  const TeamRun run = run_team("config/teams/tunnels.yaml", *dataset, folder, {},
                               "--set pose_graph.exchange_budget_kb_s=200");
  CAPTURE(run.result.output);
  REQUIRE(run.result.exit_code == 0);
  std::vector<StampedPose> team;
  for (int k = 0; k < kRobots; ++k)
    std::ranges::copy(read_trajectory(folder.path() / robot_name(k) / "optimized.tum"),
                      std::back_inserter(team));
  const fs::path file = folder.path() / "solved.tum";
  const CommandResult solve = succeeded(run_command(
      KM_BIN_DIR "/kimera_multi_pgo solve " + dataset->string() + " --output " + file.string()));
  const double apart_m = largest_distance_m(team, read_trajectory(file));
  std::cout << "tunnels: robots and solve are " << apart_m << " m apart\n";
  CHECK(apart_m < 1e-6);  // measured: 3e-7 m, the rounding of the files
}

}  // namespace
}  // namespace km
