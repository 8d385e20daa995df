#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

#include "apps/lab/experiments/experiment_plan.hpp"
#include "apps/lab/experiments/report_input.hpp"
#include "apps/lab/experiments/step_record.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;
namespace fs = std::filesystem;

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
  constexpr std::size_t kWorlds = 4, kRuns = 3;  // on the same recordings
  CHECK(steps.size() == kWorlds * (1 + kRuns * (1 + plan.config.methods.size()) + 1));
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

TEST_CASE("A world is run again on its recordings, and on those of other seeds", "[experiments]") {
  Plan plan;
  const Step again = plan.step("trajectory", "team-city-run3");
  CHECK(again.needs == std::vector<std::string>{"simulate-city"});
  CHECK_THAT(command_text(again.command), Contains("data/city/team.yaml") && Contains("--output") &&
                                              Contains("data/city-run3_res") &&
                                              Contains("--set mapping.mode=off"));
  const Step paper = plan.step("trajectory", "team-city-paper");
  CHECK(paper.needs == std::vector<std::string>{"simulate-city"});
  CHECK_THAT(command_text(paper.command),
             Contains("data/city-paper_res") &&
                 Contains("--set pcm.selection=pcm --set pose_graph.method=rbcd"));
  const auto mesh = plan_experiment("mesh", plan.config, plan.paths());
  CHECK(std::none_of(mesh.begin(), mesh.end(),
                     [](const Step& step) { return step.name.find("run") != step.name.npos; }));
  fs::copy("config", plan.folder.path() / "config", fs::copy_options::recursive);
  plan.folder.write("config/experiments/worlds.yaml",
                    "city: {robots: [a], seeds: [5], simulate: [--seed, \"1\", --labels]}\n"
                    "camp: {robots: [a], seeds: [6]}\nv1: {robots: [a]}\nv2: {robots: [a]}\n");
  plan.folder.write("config/experiments/resources.yaml", "worlds: [city]\n");
  plan.config = read_experiments(plan.folder.path() / "config/experiments", false);
  CHECK_THAT(command_text(plan.step("trajectory", "simulate-city-seed5").command),
             Contains("--seed 5 --labels") && Contains("data/city-seed5"));
  CHECK_THAT(command_text(plan.step("trajectory", "simulate-camp-seed6").command),
             Contains("--seed 6"));
  CHECK(plan.step("trajectory", "team-city-seed5").needs ==
        std::vector<std::string>{"simulate-city-seed5"});
}

TEST_CASE("One robot is run alone on the recording of a world", "[experiments]") {
  const Plan plan;
  const Step alone = plan.step("resources", "alone-v1");
  CHECK(alone.needs == std::vector<std::string>{"simulate-v1"});
  CHECK_THAT(command_text(alone.command), Contains("kimera_multi_robot") &&
                                              Contains("data/v1/V1_01") &&
                                              Contains("--rate max --set mapping.mode=off"));
}

TEST_CASE("Graphs of COSMO-Bench are solved where they are", "[experiments]") {
  const Plan plan;
  const auto steps = plan_experiment("cosmo", plan.config, plan.paths());
  REQUIRE(steps.size() == plan.config.cosmo.sets.size());
  for (const Step& step : steps) CHECK_THAT(step.missing, Contains("--graphs names its folder"));
  plan.folder.write("data/kth_r3_00_d06_d09_d10_wifi.jrl", "{}");
  const Step step = plan.step("cosmo", "cosmo-kth_r3_00_d06_d09_d10_wifi");
  CHECK(step.missing.empty());
  CHECK_THAT(command_text(step.command),
             Contains("kimera_multi_pgo solve") && Contains("_wifi.jrl --json"));
}

TEST_CASE("A step is the same wherever its files lie", "[experiments]") {
  Step step{.name = "s", .title = "", .command = {"/a/tool", "data/city/", "--rate", "max"}};
  const std::string fingerprint = fingerprint_of(step);
  step.command[0] = "/b/tool";
  step.command[1] = "/home/me/data/city";
  CHECK(fingerprint_of(step) == fingerprint);
  step.command[1] = "/home/me/data/camp";
  CHECK(fingerprint_of(step) != fingerprint);
}

TEST_CASE("Steps of several experiments are planned once, each after the steps it needs",
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

TEST_CASE("An original recording is found by the images it has", "[experiments]") {
  const TemporaryFolder folder;
  folder.write("vicon_room1/V1_01_easy/mav0/cam0/data/1000000000.png", "");
  folder.write("vicon_room1/V1_01_easy/mav0/state_groundtruth_estimate0/data.csv", "");
  folder.write("vicon_room1/V1_01_easy/mav0/imu0/data.csv", "");
  folder.write("vicon_room1/V1_02_medium/mav0/cam0/data/1000000000.png", "");
  const RecordedFlightFiles excerpt = find_recorded_flight(folder.path(), "V1_01");
  CHECK(excerpt.folder.empty());
  CHECK(excerpt.truth ==
        folder.path() / "vicon_room1/V1_01_easy/mav0/state_groundtruth_estimate0/data.csv");
  CHECK(excerpt.imu == folder.path() / "vicon_room1/V1_01_easy/mav0/imu0/data.csv");
  folder.write("vicon_room1/V1_01_easy/mav0/cam0/data/61000000000.png", "");
  CHECK(find_recorded_flight(folder.path(), "V1_01").folder ==
        folder.path() / "vicon_room1/V1_01_easy");
}

TEST_CASE("True poses and inertial data are found without images", "[experiments]") {
  const TemporaryFolder folder;
  const auto truth = folder.write("truth/V2_03_difficult.csv.gz", "");
  const auto imu = folder.write("imu/V2_03_difficult.imu.csv.gz", "");
  folder.write("truth/V2_03_difficult.pdf", "");
  const RecordedFlightFiles files = find_recorded_flight(folder.path(), "V2_03");
  CHECK(files.truth == truth);
  CHECK(files.imu == imu);
  CHECK(files.folder.empty());
  CHECK(find_recorded_flight(folder.path(), "V2_02").truth.empty());
  CHECK(find_recorded_flight({}, "V2_03").truth.empty());
  CHECK(find_recorded_flight(folder.path() / "none", "V2_03").truth.empty());
}

}  // namespace
}  // namespace km
