#include "apps/team/finished_run.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

constexpr const char* kSummary = R"({"frames": 77, "exit_reason": "finished"})";

TeamPlan plan_of(const TemporaryFolder& folder, const std::vector<std::string>& names) {
  TeamPlan plan;
  plan.output = folder.path();
  for (const std::string& name : names) {
    plan.robots.emplace_back();
    plan.robots.back().name = name;
  }
  return plan;
}

}  // namespace

TEST_CASE("How a robot ended elsewhere is read from its folder", "[team]") {
  const TemporaryFolder folder;
  folder.write("done/summary.json", kSummary);
  folder.write("told/summary.json", kSummary);
  folder.write("told/exit_code", "3\n");
  folder.write("torn/exit_code", "");
  std::string log;
  for (int i = 0; i < 30; ++i) log += "line " + std::to_string(i) + '\n';
  folder.write("told/robot.log", log);

  const auto runs = finished_runs(plan_of(folder, {"done", "told", "torn", "absent"}));
  REQUIRE(runs.size() == 4);
  CHECK(runs[0].exit.ok());
  CHECK(runs[0].last_words.empty());
  CHECK(runs[1].exit.code == 3);
  REQUIRE(runs[1].last_words.size() == 10);
  CHECK(runs[1].last_words.front() == "line 20");
  CHECK(runs[1].last_words.back() == "line 29");
  CHECK(runs[2].exit.code == 1);
  CHECK(runs[3].exit.code == 1);
}

TEST_CASE("A report starts no robot and fails if one of the run did", "[team]") {
  const TemporaryFolder folder;
  folder.write("g.csv", "");
  const auto team = folder.write("team.yaml",
                                 "robots:\n"
                                 "  - {id: 1, name: alice, graph: g.csv}\n"
                                 "  - {id: 2, name: bob, graph: g.csv}\n");
  folder.write("out/alice/summary.json", kSummary);
  const std::string command = std::string(KM_BIN_DIR) + "/kimera_multi_team --config " +
                              team.string() + " --output " + (folder.path() / "out").string() +
                              " --report --robot-binary /nonexistent";
  const CommandResult half = run_command(command);
  CAPTURE(half.output);
  CHECK(half.exit_code == 3);
  CHECK(half.output.find("bob failed") != std::string::npos);

  folder.write("out/bob/summary.json", kSummary);
  const CommandResult whole = run_command(command);
  CAPTURE(whole.output);
  CHECK(whole.exit_code == 0);
  CHECK(whole.output.find("finished") != std::string::npos);
  CHECK(whole.output.find("DDS domain") == std::string::npos);
}

}  // namespace km
