#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "modules/core/config.hpp"
#include "modules/core/text_rows.hpp"
#include "test/support/own_networks.hpp"
#include "test/support/process.hpp"
#include "test/support/random_team.hpp"
#include "test/support/shared_data.hpp"
#include "test/system/team_run.hpp"

// Teams over links that lose frames: the team program carries the frames (--links).

namespace km {
namespace {

namespace fs = std::filesystem;

// barc as in test_links.cpp. Outages are shorter than the time for which robots wait for each
// other.
constexpr const char* kSettings =
    "arguments: [--set, pose_graph.barc=20, --set, run.settle_s=10]\n";

// links.csv: by the names of the two robots, the numbers by column.
using LinksTable = std::map<std::pair<std::string, std::string>, std::map<std::string, double>>;

LinksTable read_links_table(const TemporaryFolder& folder) {
  const std::string text = folder.read("links.csv");
  const std::vector<TextRow> rows = split_rows(text);
  LinksTable table;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const auto& fields = rows[i].fields;
    auto& link = table[{std::string(fields[0]), std::string(fields[1])}];
    for (std::size_t k = 2; k < fields.size(); ++k)
      link[std::string(rows[0].fields[k])] = parse_double(fields[k]).value_or(0.0);
  }
  return table;
}

// A finished run of two robots.
struct PairRun {
  TemporaryFolder folder = {};
  TeamRun team = {};
  LinksTable links = {};

  PairRun(const SplitGraph& graph, const std::string& script) {
    const std::string file = folder.write("links.yaml", script).string();
    team = run_team(write_team(graph, folder, kSettings), folder.path(), folder, "--links " + file);
    links = read_links_table(folder);
  }
  [[nodiscard]] RunSummary summary(int robot) const {
    return read_summary(folder.path() / robot_name(robot) / "summary.json");
  }
};

SplitGraph pair_of_robots() {
  return random_team(22, {0, 1}, 40, {{0, 1}});
}

// True if a process runs with `text` on its command line.
bool is_running(const std::string& text) {
  for (const auto& process : fs::directory_iterator("/proc")) {
    std::ostringstream command;
    command << std::ifstream(process.path() / "cmdline").rdbuf();  // empty if the process has ended
    if (command.str().find(text) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("Robots in networks of their own end when their team is killed", "[system][namespaces]") {
  const TemporaryFolder folder;
  const std::string team = write_team(pair_of_robots(), folder, kSettings).string();
  const std::string output = (folder.path() / "out").string();
  Process program({"sh", "-c",
                   "exec " KM_BIN_DIR "/kimera_multi_team --config " + team + " --links " +
                       folder.write("links.yaml", "").string() + " --rate max --output " + output +
                       " 2>&1"});
  const auto is_status = [](const std::string& line) {
    return line.find("peers: robot1 alive") != line.npos || !had_own_networks(line);
  };
  const auto line = program.wait_until(is_status);
  REQUIRE(line.has_value());
  if (line->text.find("alive") == line->text.npos) return;
  program.kill(SIGKILL);
  program.wait();
  while (is_running(output)) std::this_thread::yield();  // fails by the time limit of the test
  for (const int robot : {0, 1})
    CHECK(fs::exists(fs::path(output) / robot_name(robot) / "summary.json"));
}

TEST_CASE("A team that loses a fifth of all frames loses nothing else", "[system][namespaces]") {
  const SplitGraph graph = pair_of_robots();
  const PairRun bad(graph,
                    "seed: 3\nloss: 0.2\ndelay_s: 0.01\njitter_s: 0.01\n"
                    "outages:\n  - {from_s: 0.5, to_s: 4}\n");
  CAPTURE(bad.team.result.output);
  if (!had_own_networks(bad.team.result.output)) return;
  REQUIRE(bad.team.result.exit_code == 0);
  for (const int robot : {0, 1}) {
    CHECK(bad.summary(robot).pgo.members == std::vector<RobotId>{0, 1});
    CHECK(bad.summary(robot).pgo.settled);
  }
  for (const auto& [pair, link] : bad.links) {
    CHECK(link.at("frames_loss") > 0);
    CHECK(link.at("frames_outage") > 0);
    CHECK(link.at("frames_delivered") > link.at("frames_loss"));
  }

  const PairRun good(graph, "");
  CAPTURE(good.team.result.output);
  REQUIRE(good.team.result.exit_code == 0);
  for (const auto& [pair, link] : good.links) CHECK(link.at("frames_delivered") > 0);
  const TeamResult found = read_team(bad.folder.path(), 2);
  const TeamResult expected = read_team(good.folder.path(), 2);
  CHECK(found.graph.edges.size() == expected.graph.edges.size());
  const double cost = cost_of(found.graph, found.poses);
  const double best = cost_of(expected.graph, expected.poses);
  std::cout << "over bad links: cost " << cost << " of " << found.graph.edges.size()
            << " edges, over good ones " << best << '\n';
  CHECK(cost == Approx(best).epsilon(1e-9).margin(0.0));
}

TEST_CASE("A team in two parts ends in two frames and its table of links gives the reason",
          "[system][namespaces]") {
  const PairRun run(pair_of_robots(), "partitions:\n  - {groups: [[robot0], [robot1]]}\n");
  CAPTURE(run.team.result.output);
  if (!had_own_networks(run.team.result.output)) return;
  REQUIRE(run.team.result.exit_code == 0);
  for (const RobotId robot : {RobotId{0}, RobotId{1}}) {
    CHECK(run.summary(robot).pgo.members == std::vector<RobotId>{robot});
    CHECK(run.summary(robot).pgo.anchor == robot);
  }
  CHECK_THAT(run.team.result.output, Catch::Contains("never joined the other robot"));
  REQUIRE(run.links.size() == 2);
  for (const auto& [pair, link] : run.links) {
    CHECK(link.at("frames_in") > 0);
    CHECK(link.at("frames_partition") == link.at("frames_in"));
    CHECK(link.at("frames_delivered") == 0);
  }
}

namespace {

void find_closures_between_ends(bool has_keys) {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  // c receives a alone, then b as well.
  const std::string links = folder
                                .write("links.yaml",
                                       "pairs:\n"
                                       "  - {from: a, to: b, outages: [{from_s: 0}]}\n"
                                       "  - {from: b, to: c, outages: [{from_s: 0, to_s: 20}]}\n")
                                .string();
  const auto team =
      folder.write("team.yaml", "config: " + fs::absolute("config/datasets/euroc.yaml").string() +
                                    "\narguments: [--set, run.settle_s=40]\nrobots:\n"
                                    "  - {id: 0, name: a, dataset: \"${DATASET}\", to: 7.5}\n"
                                    "  - {id: 1, name: b, dataset: \"${DATASET}\", from: 7.5, "
                                    "to: 15.0}\n"
                                    "  - {id: 2, name: c, dataset: \"${DATASET}\", from: 4.0, "
                                    "to: 11.0}\n");
  std::string options = "--links " + links;
  if (has_keys) {
    const std::string keys = (folder.path() / "keys").string();
    REQUIRE(run_command(KM_BIN_DIR "/kimera_multi_keys make " + keys + " --robots a:0,b:1,c:2")
                .exit_code == 0);
    options += " --security " + keys;
  }
  const TeamRun run = run_team(team, *dataset, folder, options);
  CAPTURE(run.result.output);
  if (!had_own_networks(run.result.output)) return;
  REQUIRE(run.result.exit_code == 0);
  for (const char* name : {"a", "b", "c"}) {
    const RunSummary summary = read_summary(folder.path() / name / "summary.json");
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1, 2});
  }
  // Each closure between a and b is in both files, once.
  std::map<std::pair<KeyframeId, KeyframeId>, int> closures;
  for (const char* name : {"a", "b"})
    for (const RelativePose& edge : read_g2o(folder.path() / name / "pose_graph.g2o").edges)
      if (edge.from.robot + edge.to.robot == 1 && edge.from.robot != edge.to.robot)
        ++closures[{edge.from, edge.to}];
  std::cout << closures.size() << " closures between robots that never receive each other"
            << (has_keys ? ", with keys\n" : "\n");
  CHECK(closures.size() >= 3);
  for (const auto& [ends, count] : closures) CHECK(count == 2);
}

}  // namespace

TEST_CASE("Robots that never receive each other find closures through one that receives both",
          "[system][namespaces]") {
  find_closures_between_ends(false);
}

TEST_CASE(
    "Robots with keys that never receive each other find closures through one that receives both",
    "[system][namespaces]") {
  find_closures_between_ends(true);
}

namespace {

// Properties of bad links, constant during the run except for the outage.
struct BadLinks {
  double outage_s = 0.0;  // from kOutage_s on
  double loss = 0.0;
  double delay_s = 0.0;

  static constexpr double kOutage_s = 2.0;

  [[nodiscard]] std::string script() const {
    return "rate_bytes_per_s: 125000\nqueue_bytes: 60000\nloss: " + shortest_text(loss) +
           "\ndelay_s: " + shortest_text(delay_s) +
           "\noutages:\n  - {from_s: " + shortest_text(kOutage_s) +
           ", to_s: " + shortest_text(kOutage_s + outage_s) + "}\n";
  }
};

std::ostream& operator<<(std::ostream& out, const BadLinks& links) {
  return out << "outage " << links.outage_s << " s, loss " << links.loss << ", delay "
             << links.delay_s << " s";
}

// Any two values of two of the three quantities occur together in one of nine combinations.
std::vector<BadLinks> all_pairs() {
  constexpr double kOutages_s[] = {5.0, 20.0, 60.0};
  constexpr double kLosses[] = {0.0, 0.1, 0.3};
  constexpr double kDelays_s[] = {0.0, 0.1, 0.5};
  std::vector<BadLinks> all;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      all.push_back({kOutages_s[i], kLosses[j], kDelays_s[(i + j) % 3]});
  return all;
}

// Team file of two robots of the tunnels. They trust all closures, so that the kept closures do not
// depend on the order of events.
std::string tunnels_team(double settle_s) {
  std::string team =
      "arguments: [--link, wifi, --set, pose_graph.robust=false, --set, run.settle_s=" +
      shortest_text(settle_s) + "]\nrate: max\nrobots:\n";
  for (const char* number : {"0", "1"})
    team += std::string("  - {id: ") + number + ", name: robot" + number +
            ", graph: \"${DATASET}/robot" + number + ".csv\"}\n";
  return team;
}

// Team file of two robots that play the halves of the flight MH_01 in real time.
std::string halves_team(double settle_s) {
  return "config: " + fs::absolute("config/datasets/euroc.yaml").string() +
         "\narguments: [--link, wifi, --set, run.settle_s=" + shortest_text(settle_s) +
         "]\nrobots:\n"
         "  - {id: 0, name: robot0, dataset: \"${DATASET}\", to: 7.5}\n"
         "  - {id: 1, name: robot1, dataset: \"${DATASET}\", from: 7.5, to: 15.0}\n";
}

// A run of two robots with the status lines that they printed.
class PrintedRun {
 public:
  // `links`: the text of a file of links, or a recorded link.
  PrintedRun(const std::string& team, const fs::path& dataset,
             const std::variant<std::string, fs::path>& links) {
    const auto* text = std::get_if<std::string>(&links);
    const fs::path file = text ? folder_.write("links.yaml", *text) : std::get<fs::path>(links);
    const std::string command = std::string("exec " KM_BIN_DIR "/kimera_multi_team --config ") +
                                folder_.write("team.yaml", team).string() + " --links " +
                                file.string() + " --dataset " + dataset.string() + " --output " +
                                folder_.path().string() + " -- --serve-limit 1000 2>&1";
    Process process({"sh", "-c", command});
    exit_code_ = process.wait();
    process.wait_until([](const std::string&) { return false; });  // all it printed is read
    started_ = process.started();
    lines_ = process.lines();
  }

  [[nodiscard]] int exit_code() const { return exit_code_; }
  [[nodiscard]] std::string output() const {
    std::string all;
    for (const TimedLine& line : lines_) all += line.text + '\n';
    return all;
  }
  [[nodiscard]] TeamResult team() const { return read_team(folder_.path(), 2); }
  // Bytes of all frames that either robot sent, whether or not they arrived.
  [[nodiscard]] double sent_bytes() const {
    double bytes = 0.0;
    for (const auto& [pair, link] : read_links_table(folder_)) bytes += link.at("bytes_in");
    return bytes;
  }
  [[nodiscard]] RunSummary summary(int robot) const {
    return read_summary(folder_.path() / robot_name(robot) / "summary.json");
  }

  // Number of occurrences of each closure in the robots' files; a closure between two robots is in
  // both.
  [[nodiscard]] std::map<std::pair<KeyframeId, KeyframeId>, int> closures() const {
    std::map<std::pair<KeyframeId, KeyframeId>, int> count;
    for (const int robot : {0, 1})
      for (const RelativePose& edge :
           read_g2o(folder_.path() / robot_name(robot) / "pose_graph.g2o").edges)
        ++count[{edge.from, edge.to}];
    return count;
  }

  // Time of the last change of closures or optimiser state [s since the start], by the status lines
  // of the robots, one a second.
  [[nodiscard]] double agreed_s() const {
    double last_s = 0.0;
    std::map<std::string, std::string> last;  // by robot
    for (const auto& [text, time] : lines_) {
      const std::size_t begin = text.find("closures: "), end = text.find(" | out: ");
      if (begin == text.npos || end == text.npos) continue;
      std::string& before = last[text.substr(0, text.find(' '))];
      const std::string now = text.substr(begin, end - begin);
      if (now != before) last_s = std::chrono::duration<double>(time - started_).count();
      before = now;
    }
    return last_s;
  }

 private:
  TemporaryFolder folder_;
  int exit_code_ = -1;
  Process::TimePoint started_;
  std::vector<TimedLine> lines_;
};

}  // namespace

TEST_CASE("Whatever links two robots have, no closure is lost or doubled", "[system][endurance]") {
  if (std::getenv("KM_LINKS") == nullptr) {
    std::cout << "SKIPPED: takes half an hour, see test/endure links\n";
    return;
  }
  const auto dataset = shared_data("multi_robot/tunnels_8robots");
  if (!dataset) return;
  const PrintedRun perfect(tunnels_team(3.0), *dataset, std::string());
  if (!had_own_networks(perfect.output())) return;
  REQUIRE(perfect.exit_code() == 0);
  const TeamResult expected = perfect.team();
  const double best = cost_of(expected.graph, expected.poses);
  for (const BadLinks& links : all_pairs()) {
    CAPTURE(links);
    const PrintedRun run(tunnels_team(links.outage_s + 10.0), *dataset,  // they stay on for it
                         links.script());
    REQUIRE(run.exit_code() == 0);
    const auto closures = run.closures();
    int lost = 0, doubled = 0;
    for (const auto& [ends, count] : perfect.closures()) {
      const auto found = closures.find(ends);
      const int now = found == closures.end() ? 0 : found->second;
      lost += std::max(count - now, 0);
      doubled += std::max(now - count, 0);
    }
    const TeamResult team = run.team();
    const double cost = cost_of(team.graph, team.poses);
    std::cout << links << ": closures lost " << lost << ", doubled " << doubled
              << ", cost apart by " << std::abs(cost - best) / best
              << " of it, link-up to agreement "
              << run.agreed_s() - BadLinks::kOutage_s - links.outage_s << " s, frames of "
              << 1e-6 * run.sent_bytes() << " MB, " << run.summary(0).exit_reason << std::endl;
    CHECK(closures == perfect.closures());
    CHECK(cost == Approx(best).epsilon(1e-6).margin(0.0));
  }
}

TEST_CASE("Two robots join over every recorded radio link", "[system][radio_links]") {
  if (std::getenv("KM_LINKS") == nullptr) {
    std::cout << "SKIPPED: takes minutes, see test/endure radios\n";
    return;
  }
  const auto recordings = shared_data("radio_links");
  const auto tunnels = shared_data("multi_robot/tunnels_8robots");
  const auto flight = shared_data("euroc/MH_01_easy");
  if (!recordings || !tunnels || !flight) return;
  constexpr double kSettle_s = 30.0;  // longer than any pause of the links
  std::vector<std::variant<std::string, fs::path>> links = {std::string()};
  for (const char* name :
       {"ATT-LTE-driving-2016.up", "TMobile-UMTS-driving.up", "Verizon-EVDO-driving.up"})
    links.emplace_back(*recordings / name);
  for (const auto& [team, dataset] :
       {std::pair(halves_team(kSettle_s), *flight), {tunnels_team(kSettle_s), *tunnels}})
    for (const auto& link : links) {
      const auto* file = std::get_if<fs::path>(&link);
      const std::string name = file ? file->stem().string() : "no limit";
      CAPTURE(dataset, name);
      const PrintedRun run(team, dataset, link);
      if (!had_own_networks(run.output())) return;
      REQUIRE(run.exit_code() == 0);
      const auto members = run.summary(0).pgo.members;
      std::cout << dataset.filename().string() << " over " << name << ": "
                << (members.size() == 2 ? "joined" : "apart") << ", " << run.closures().size()
                << " edges, frames of " << 1e-6 * run.sent_bytes() << " MB, agreement after "
                << run.agreed_s() << " s" << std::endl;
      CHECK(members == std::vector<RobotId>{0, 1});
      CHECK(run.summary(1).pgo.members == members);
    }
}

}  // namespace km
