#include "modules/core/io/text_rows.hpp"
#include "test/support/own_networks.hpp"
#include "test/support/random_team.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"
#include "test/system/team_run.hpp"

// Teams over links that lose frames: the team program carries the frames (--links).

namespace km {
namespace {

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

  PairRun(const SplitGraph& graph, const std::string& script, const std::string& options = {}) {
    const std::string file = folder.write("links.yaml", script).string();
    team = run_team(write_team(graph, folder, kSettings), folder.path(), folder, "--links " + file,
                    options);
    links = read_links_table(folder);
  }
  [[nodiscard]] RunSummary summary(int robot) const {
    return read_summary(folder.path() / robot_name(robot) / "summary.json");
  }
};

SplitGraph pair_of_robots() {
  return random_team(22, {0, 1}, 40, {{0, 1}});
}

}  // namespace

TEST_CASE("A team that loses a fifth of all frames loses nothing else", "[namespaces]") {
  const SplitGraph graph = pair_of_robots();
  std::optional<PairRun> good;  // beside the other one, because robots mostly wait
  std::jthread runner([&] { good.emplace(graph, ""); });
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

  runner.join();
  CAPTURE(good->team.result.output);
  REQUIRE(good->team.result.exit_code == 0);
  for (const auto& [pair, link] : good->links) CHECK(link.at("frames_delivered") > 0);
  const TeamResult found = read_team(bad.folder.path(), 2);
  const TeamResult expected = read_team(good->folder.path(), 2);
  CHECK(found.graph.edges.size() == expected.graph.edges.size());
  const double cost = cost_of(found.graph, found.poses);
  const double best = cost_of(expected.graph, expected.poses);
  std::cout << "over bad links: cost " << cost << " of " << found.graph.edges.size()
            << " edges, over good ones " << best << '\n';
  CHECK(cost == Approx(best).epsilon(1e-9).margin(0.0));
}

TEST_CASE("A team in two parts ends in two frames and its table of links gives the reason",
          "[namespaces]") {
  // Each waits for the other one up to the limit.
  const PairRun run(pair_of_robots(), "partitions:\n  - {groups: [[robot0], [robot1]]}\n",
                    "--serve-limit 20");
  CAPTURE(run.team.result.output);
  if (!had_own_networks(run.team.result.output)) return;
  REQUIRE(run.team.result.exit_code == 0);
  for (const RobotId robot : {RobotId{0}, RobotId{1}}) {
    CHECK(run.summary(robot).pgo.members == std::vector<RobotId>{robot});
    CHECK(run.summary(robot).pgo.anchor == robot);
  }
  CHECK_THAT(run.team.result.output, Contains("never joined the other robot"));
  REQUIRE(run.links.size() == 2);
  for (const auto& [pair, link] : run.links) {
    CHECK(link.at("frames_in") > 0);
    CHECK(link.at("frames_partition") == link.at("frames_in"));
    CHECK(link.at("frames_delivered") == 0);
  }
}

TEST_CASE(
    "Robots with keys that never receive each other find closures through one that receives both",
    "[namespaces]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  // c receives a alone, then b as well.
  const std::string links = folder
                                .write("links.yaml",
                                       "pairs:\n"
                                       "  - {from: a, to: b, outages: [{from_s: 0}]}\n"
                                       "  - {from: b, to: c, outages: [{from_s: 0, to_s: 10}]}\n")
                                .string();
  const auto team =
      folder.write("team.yaml", "config: " + fs::absolute("config/datasets/euroc.yaml").string() +
                                    "\narguments: [--set, run.settle_s=20]\nrobots:\n"
                                    "  - {id: 0, name: a, dataset: \"${DATASET}\", to: 7.5}\n"
                                    "  - {id: 1, name: b, dataset: \"${DATASET}\", from: 7.5, "
                                    "to: 15.0}\n"
                                    "  - {id: 2, name: c, dataset: \"${DATASET}\", from: 4.0, "
                                    "to: 11.0}\n");
  const std::string keys = (folder.path() / "keys").string();
  make_keys(keys, "a:0,b:1,c:2");
  const TeamRun run = run_team(team, *dataset, folder, "--links " + links + " --security " + keys);
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
  CHECK(closures.size() >= 3);
  for (const auto& [ends, count] : closures) CHECK(count == 2);
}

}  // namespace km
