#include "apps/team/team_file.hpp"

#include "apps/team/run_team.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// A folder with the files that team files name.
struct Inputs {
  TemporaryFolder folder;
  fs::path dataset = folder.path() / "recording";
  Inputs() {
    fs::create_directories(dataset);
    folder.write("common.yaml", "");
    folder.write("truth.csv", "");
    folder.write("recording/g.csv", "");
  }
  fs::path team(const std::string& text) const { return folder.write("team.yaml", text); }
};

std::string problems_of(const fs::path& file, const fs::path& dataset) {
  try {
    static_cast<void>(read_team_file(file, dataset));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("A corrupted team file is refused by name, or plans robots") {
  const Inputs inputs;
  check_corrupted<ConfigError>(
      "config: common.yaml\ntruth: truth.csv\nrate: max\ndomain: 7\nrobots:\n"
      "  - {id: 3, name: a, dataset: \"${DATASET}\", from: 0, to: 7.5}\n"
      "  - {id: 300, graph: \"${DATASET}/g.csv\", arguments: --verbose}\n",
      "team.yaml", [&](const std::string& text) {
        const TeamPlan plan = read_team_file(inputs.team(text), inputs.dataset);
        CHECK_FALSE(plan.robots.empty());
        for (const RobotPlan& robot : plan.robots) CHECK(is_folder_name(robot.name));
      });
}

TEST_CASE("A team file gives the robots their inputs") {
  const Inputs inputs;
  const fs::path file = inputs.team(
      "config: common.yaml\n"
      "truth: truth.csv\n"
      "rate: max\n"
      "domain: 7\n"
      "output: out/here\n"
      "closure_truth: {max_translation_m: 1.5}\n"
      "arguments: [--link, wifi]\n"
      "robots:\n"
      "  - {id: 3, name: a, dataset: \"${DATASET}\", from: 0, to: 7.5}\n"
      "  - {id: 300, graph: \"${DATASET}/g.csv\", arguments: --verbose, truth: recording/g.csv}\n");
  const TeamPlan plan = read_team_file(file, inputs.dataset);
  CHECK(plan.configs == std::vector{inputs.folder.path() / "common.yaml"});
  CHECK(plan.rate == "max");
  CHECK(plan.domain == 7U);
  CHECK(plan.output == "out/here");
  CHECK(plan.closure_truth.max_translation_m == 1.5);
  REQUIRE(plan.robots.size() == 2);
  const RobotPlan& a = plan.robots[0];
  CHECK(a.id == 3);
  CHECK(a.name == "a");
  CHECK(a.dataset == inputs.dataset);
  CHECK(a.graph.empty());
  CHECK(a.from_s == 0.0);
  CHECK(a.to_s == 7.5);
  CHECK(a.truth == inputs.folder.path() / "truth.csv");
  const RobotPlan& b = plan.robots[1];
  CHECK(b.id == 300);
  CHECK(b.name == "robot300");
  CHECK(b.graph == inputs.dataset / "g.csv");
  CHECK_FALSE(b.from_s);
  CHECK(b.truth == inputs.dataset / "g.csv");
  CHECK(b.arguments == std::vector<std::string>{"--link", "wifi", "--verbose"});
}

TEST_CASE("A truth may be a folder, and one that is missing is a note") {
  const Inputs inputs;
  inputs.folder.write("truth/groundtruth_tum.txt", "");
  const fs::path file = inputs.team(
      "truth: none.csv\n"
      "robots:\n"
      "  - {id: 1, graph: recording/g.csv}\n"
      "  - {id: 2, graph: recording/g.csv, truth: truth}\n");
  const TeamPlan plan = read_team_file(file, {});
  CHECK(plan.robots[0].truth.empty());
  CHECK(plan.robots[1].truth == inputs.folder.path() / "truth/groundtruth_tum.txt");
  REQUIRE(plan.notes.size() == 1);
  CHECK_THAT(plan.notes[0],
             Contains("no true poses, so no errors: ") && Contains("none.csv is neither"));
  inputs.folder.write("truth/data.csv", "");
  CHECK(read_team_file(file, {}).robots[1].truth == inputs.folder.path() / "truth/data.csv");
}

TEST_CASE("The command line of a robot has the options of its plan") {
  TeamPlan plan;
  plan.configs = {"/c.yaml", "/d.yaml"};
  plan.domain = 9;
  plan.output = "out";
  plan.view = true;
  RobotPlan robot;
  robot.id = 4;
  robot.name = "x";
  robot.dataset = "/data";
  robot.from_s = 7.5;
  robot.arguments = {"--set", "a.b=1"};
  CHECK(robot_command("/bin/robot", plan, robot) ==
        std::vector<std::string>{"/bin/robot", "--config", "/c.yaml",  "--config", "/d.yaml",
                                 "--robot",    "4",        "--name",   "x",        "--dataset",
                                 "/data",      "--from",   "7.5",      "--rate",   "auto",
                                 "--domain",   "9",        "--output", "out/x",    "--view",
                                 "--set",      "a.b=1"});
}

TEST_CASE("Every problem of a team file is reported with its line") {
  const Inputs inputs;
  fs::create_symlink("loop", inputs.folder.path() / "loop");
  const std::string robots = "robots:\n  - {id: 1, graph: recording/g.csv}\n";
  const std::vector<std::pair<std::string, std::vector<std::string>>> files = {
      {"config: none.yaml\nspeed: 3\ndomain: 500\nrobots:\n"
       "  - {id: 1, name: a, dataset: recording}\n"
       "  - {id: 1, name: a/b, graph: recording}\n"
       "  - {id: 70000, name: c}\n"
       "  - {id: 2, dataset: x, from: soon}\n"
       "  - {id: 3, dataset: loop}\n",
       {":1: config = none.yaml is no file or folder: ", ":2: unknown key speed",
        ":3: domain = 500 is outside 0 .. 230", ":6: robots.name = a/b is not made of",
        ":6: robots repeat the id 1", ":7: robots.id = 70000 is not a whole number, 0 .. 65535",
        ":7: robots.dataset or else graph is needed", ":8: robots.dataset = x is no file or folder",
        ":8: robots.from = soon is not a number",
        ":9: robots.dataset = loop is no file or folder"}},
      {"closure_truth: {min_overlap: 2, max_rotation_deg: -1, near: 3}\n" + robots,
       {"team.yaml:1: closure_truth.min_overlap = 2 is outside 1e-06 .. 1",
        "max_rotation_deg = -1 is outside 1e-06 .. 180", "unknown key closure_truth.near"}},
      {"robots:\n  - {id: 1, datset: recording}\n",
       {":2: unknown key robots.datset (did you mean dataset?)\n",
        "robots.dataset or else graph is needed"}},
      {"robtos: []\n", {":1: unknown key robtos (did you mean robots?)\n", "robots is missing"}},
      {"rate: fast\n", {":1: rate = fast is neither a positive number nor max"}},
      {"robots: []\n", {"is empty"}},
      {"robots:\n  - {id: 1, dataset: \"${DATASET}\"}\n",
       {":2: robots.dataset = ${DATASET} needs --dataset"}},
      {"robots: [\n", {"team.yaml:2: not YAML"}},
      {"just text\n", {"is not a map of keys and values"}}};
  for (const auto& [text, all] : files) {
    const std::string problems = problems_of(inputs.team(text), {});
    for (const std::string& expected : all) CHECK_THAT(problems, Contains(expected));
  }
  CHECK_THAT(problems_of("/no/team.yaml", {}), Contains("no such file"));
}

TEST_CASE("Arguments name inputs relative to the team file, and ${DATASET}") {
  const Inputs inputs;
  const fs::path file = inputs.team(
      "arguments: [--config, common.yaml, --link, wifi]\n"
      "robots:\n"
      "  - {id: 1, graph: recording/g.csv, arguments: [\"--rig=${DATASET}/g.csv\", --set,\n"
      "    \"segmentation.model=${DATASET}/a.onnx\", --rig, recording/g.csv]}\n");
  const std::string dataset = inputs.dataset.string();
  CHECK(read_team_file(file, inputs.dataset).robots[0].arguments ==
        std::vector<std::string>{"--config", (inputs.folder.path() / "common.yaml").string(),
                                 "--link", "wifi", "--rig=" + dataset + "/g.csv", "--set",
                                 "segmentation.model=" + dataset + "/a.onnx", "--rig",
                                 dataset + "/g.csv"});
  const std::string problems = problems_of(
      inputs.team("robots:\n  - id: 1\n    graph: recording/g.csv\n    arguments:\n      - --rig\n"
                  "      - none.yaml\n      - --set=x.y=${DATASET}\n"),
      {});
  CHECK_THAT(problems, Contains("team.yaml:6: arguments: none.yaml is no file or folder") &&
                           Contains("team.yaml:7: arguments: --set=x.y=${DATASET} needs"));
}

TEST_CASE("The team files that are shipped lack only recordings") {
  const TemporaryFolder dataset;
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator("config/teams")) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    std::istringstream problems(problems_of(entry.path(), dataset.path()));
    for (std::string line; std::getline(problems, line);)
      CHECK_THAT(line, Contains("there is no " + dataset.path().string()));
  }
  CHECK(files == 8);
}

}  // namespace km
