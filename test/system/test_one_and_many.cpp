#include <catch2/catch.hpp>

#include <fstream>
#include <iostream>

#include "test/support/random_team.hpp"
#include "test/system/recorded_team.hpp"
#include "test/system/team_result.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kRobots = 5;

// A team file for the parts in `folder`.
void write_team(const fs::path& folder) {
  std::ofstream team(folder / "team.yaml");
  team << "robots:\n";
  for (int k = 0; k < kRobots; ++k)
    team << "  - {id: " << k << ", name: robot" << k << ", graph: part" << k << ".g2o}\n";
}

TEST_CASE("Five processes over DDS come to the cost that one process comes to", "[system]") {
  const SplitGraph graph =
      random_team(20, {0, 1, 2, 3, 4}, 40, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {0, 4}, {1, 3}});
  const TemporaryFolder folder;
  for (RobotId k = 0; k < kRobots; ++k)
    write_part(graph, k, folder.path() / ("part" + std::to_string(k) + ".g2o"));
  write_team(folder.path());
  const TeamRun run = run_team_file(folder.path() / "team.yaml", folder.path(), folder);
  CAPTURE(run.result.output);
  REQUIRE(run.result.exit_code == 0);
  for (const auto& robot : run.json["robots"]) CHECK(robot["pgo"]["members"].size() == kRobots);

  const TeamResult team = read_team(folder.path(), kRobots);
  CHECK(team.poses.size() == 5 * 40);
  CHECK(team.graph.edges.size() >= 5 * 39 + 4 * 3);  // connected by sets of three or more
  const double many = cost_of(team.graph, team.poses);
  const double one = solved_in_one_process(folder.path(), kRobots);
  const double difference = std::abs(many - one) / one;
  std::cout << "five processes: cost " << many << ", one process " << one << ", apart by "
            << difference << " of it\n";
  CHECK(difference < 1e-9);
}

}  // namespace
}  // namespace km
