#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

#include "apps/experiments/experiment_plan.hpp"
#include "apps/experiments/report_input.hpp"
#include "apps/experiments/step_record.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

struct Plan {
  TemporaryFolder folder;
  ExperimentConfig config = read_experiments("config/experiments", false);
  ExperimentPaths paths() const {
    return {.programs = "/programs",
            .data = folder.path() / "data",
            .results = folder.path() / "results",
            .graphs = folder.path() / "data",
            .euroc = folder.path() / "euroc"};
  }
  Step step(const std::string& experiment, const std::string& name) const {
    const auto steps = plan_experiment(experiment, config, paths());
    const auto found =
        std::find_if(steps.begin(), steps.end(), [&](const auto& s) { return s.name == name; });
    REQUIRE(found != steps.end());
    return *found;
  }
  StepState state(const std::string& experiment, const std::string& name) const {
    return state_of(step(experiment, name), paths().results);
  }
};

TEST_CASE("A world is simulated, its team is run, its graph is solved by every method",
          "[experiments]") {
  const Plan plan;
  const auto steps = plan_experiment("trajectory", plan.config, plan.paths());
  CHECK(steps.size() == 4 * (2 + plan.config.methods.size()));
  CHECK(steps[0].name == "simulate-city");
  CHECK(steps[1].name == "team-city");
  CHECK(steps[1].needs == std::vector<std::string>{"simulate-city"});
  CHECK_THAT(command_text(steps[1].command), Contains("kimera_multi_team --config") &&
                                                 Contains("data/city/team.yaml") &&
                                                 Contains("--rate max"));
  CHECK_THAT(command_text(plan.step("trajectory", "pgo-city-rbcd50").command),
             Contains("kimera_multi_pgo") && Contains("--rounds 50 --json"));
  CHECK(plan.step("trajectory", "pgo-city-dgs").copies.size() == 3);
}

TEST_CASE("Steps of several experiments are planned once, each after what it needs",
          "[experiments]") {
  const Plan plan;
  const auto steps =
      plan_experiments({"trajectory", "resources", "mesh", "semantics"}, plan.config, plan.paths());
  std::vector<std::string> names;
  for (const Step& step : steps) {
    for (const std::string& need : step.needs) {
      CAPTURE(step.name, need);
      CHECK(std::count(names.begin(), names.end(), need) == 1);
    }
    names.push_back(step.name);
  }
  std::sort(names.begin(), names.end());
  CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());
}

TEST_CASE("Recordings that are whole are used, others are made", "[experiments]") {
  const Plan plan;
  CHECK(plan.state("mesh", "simulate-city") == StepState::kToDo);
  plan.folder.write("data/city/team.yaml", "");
  plan.folder.write("data/city/simulation.json", "{\"complete\": false}");
  CHECK(plan.state("mesh", "simulate-city") == StepState::kToDo);
  plan.folder.write("data/city/simulation.json", "{\"complete\": true}");
  CHECK(plan.state("mesh", "simulate-city") == StepState::kFound);
}

TEST_CASE("A team's run that was made elsewhere is not repeated, our own is when inputs change",
          "[experiments]") {
  const Plan plan;
  for (const char* robot : {"robot0", "robot1", "robot2"})
    plan.folder.write(std::string("data/city_res/") + robot + "/summary.json", "{}");
  CHECK_THAT(command_text(plan.step("mesh", "team-city").command), Contains("--report"));
  StepRecord own;
  own.step = "team-city";
  own.command = {"kimera_multi_team"};
  write_record(plan.paths().results, own);
  CHECK_THAT(command_text(plan.step("mesh", "team-city").command), !Contains("--report"));
  own.command.emplace_back("--report");
  write_record(plan.paths().results, own);
  CHECK_THAT(command_text(plan.step("mesh", "team-city").command), Contains("--report"));
}

TEST_CASE("The rooms need recorded flights, or use their images", "[experiments]") {
  const Plan plan;
  CHECK(plan.state("mesh", "simulate-v1") == StepState::kMissing);
  CHECK_THAT(plan.step("mesh", "simulate-v1").missing, Contains("V1_01") && Contains("--euroc"));
  for (const char* flight : {"V1_01", "V1_02", "V1_03"}) {
    plan.folder.write(std::string("euroc/") + flight + "_easy.csv", "");
    plan.folder.write(std::string("euroc/") + flight + "_easy.imu.csv.gz", "");
  }
  CHECK(plan.state("mesh", "simulate-v1") == StepState::kToDo);
  CHECK_THAT(command_text(plan.step("mesh", "simulate-v1").command),
             Contains("V1_03_easy.imu.csv.gz --names V1_01 V1_02 V1_03"));
  for (const char* flight : {"V1_01", "V1_02", "V1_03"})
    for (const char* stamp : {"1", "60000000000"})
      plan.folder.write(std::string("euroc/") + flight + "_easy/mav0/cam0/data/" + stamp + ".png",
                        "");
  const Step team = plan.step("mesh", "team-v1");
  CHECK(team.needs.empty());
  REQUIRE(team.writes.size() == 1);
  CHECK_THAT(team.writes[0].second, Contains("V1_02_easy") && Contains("datasets/euroc.yaml"));
}

}  // namespace
}  // namespace km
