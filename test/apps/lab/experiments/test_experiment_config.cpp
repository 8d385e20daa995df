#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

#include "apps/lab/experiments/experiment_config.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;
namespace fs = std::filesystem;

// The shipped configuration, to be corrupted.
struct CorruptedConfig {
  TemporaryFolder folder;
  CorruptedConfig() { fs::copy("config", folder.path(), fs::copy_options::recursive); }
  fs::path experiments() const { return folder.path() / "experiments"; }
  std::string problems() const {
    try {
      const auto config = read_experiments(experiments(), false);
      return {};
    } catch (const ConfigError& error) {
      return error.what();
    }
  }
};

TEST_CASE("The shipped experiments are the paper's", "[experiments]") {
  const ExperimentConfig config = read_experiments("config/experiments", false);
  CHECK(config.trajectory_worlds == std::vector<std::string>{"city", "camp", "v1", "v2"});
  CHECK(config.pcm.outliers == 1000);
  CHECK(config.methods.size() == 6);
  CHECK(config.world("v1").flights);
  CHECK(config.world("v2").robots == std::vector<std::string>{"V2_01", "V2_02", "V2_03"});
}

TEST_CASE("Quick keys replace those beside them", "[experiments]") {
  const ExperimentConfig config = read_experiments("config/experiments", true);
  CHECK(config.pcm.outliers < 1000);
  CHECK(config.pcm.searches.size() == 3);
  CHECK_FALSE(config.world("v1").flights);
  CHECK(config.trajectory_worlds.size() == 2);
}

TEST_CASE("Every world has a run at each level and seed", "[experiments]") {
  const ExperimentConfig config = read_experiments("config/experiments", false);
  const auto runs = [&](unsigned level, const std::string& length) {
    return std::ranges::count_if(config.level_runs, [&](const LevelRun& run) {
      return run.level == level && run.length == length;
    });
  };
  CHECK(runs(2, "") == 9);  // three worlds, three seeds
  CHECK(runs(2, "long") == 9);
  CHECK(runs(3, "long") == 0);
  for (const LevelRun& run : config.level_runs) {
    const std::vector<std::string>& options = config.world(run.world).simulate;
    const auto option = std::ranges::find(options, "--difficulty");
    REQUIRE(option + 1 < options.end());
    CHECK(*(option + 1) == std::to_string(run.level));
  }
  CHECK(config.world("level2-city-seed3").robots.size() == 2);
  CHECK(read_experiments("config/experiments", true).level_runs.size() == 1);
}

TEST_CASE("Levels of difficulty out of range are named", "[experiments]") {
  const CorruptedConfig config;
  config.folder.write("experiments/levels.yaml",
                      "worlds: [{name: city, simulate: []}]\nlevels: [{level: 5, seeds: [1]}]\n");
  CHECK_THAT(config.problems(), Contains("levels.yaml:2") && Contains("level"));
}

TEST_CASE("Errors of the configuration are named by file, line and key", "[experiments]") {
  const CorruptedConfig config;
  REQUIRE(config.problems().empty());
  config.folder.write("experiments/pcm.yaml",
                      "graph: g.g2o\nseeds: [1]\nsearches: [exact, clever]\noutlier: 3\n");
  CHECK_THAT(config.problems(),
             Contains("pcm.yaml:3: searches = [exact, clever] has clever, which is not exact") &&
                 Contains("pcm.yaml:4: unknown key outlier (did you mean outliers?)"));
  config.folder.write("experiments/pcm.yaml", "graph: g.g2o\nseeds: many\n");
  CHECK_THAT(config.problems(), Contains("pcm.yaml:2: seeds = many is not a whole number") &&
                                    Contains("searches is missing"));
  config.folder.write("experiments/pcm.yaml", "graph: [\n");
  CHECK_THAT(config.problems(), Contains("pcm.yaml:2: not YAML"));
}

TEST_CASE("Worlds that are not there are named", "[experiments]") {
  const CorruptedConfig config;
  config.folder.write("experiments/mesh.yaml", "worlds: [city, moon, mars]\n");
  config.folder.write("experiments/worlds.yaml",
                      "city: {robots: [a], simulation: ../simulation/none.yaml, rate: 2}\n");
  CHECK_THAT(config.problems(),
             Contains("mesh.yaml:1: worlds = [city, moon, mars] has moon") &&
                 Contains("has mars, which is not in worlds.yaml") && Contains("worlds.yaml:1") &&
                 Contains("none.yaml") && Contains("unknown key city.rate") &&
                 Contains("trajectory.yaml:6: worlds = [city, camp, v1, v2] has camp"));
  fs::remove(config.experiments() / "mesh.yaml");
  CHECK_THAT(config.problems(), Contains("mesh.yaml: cannot open"));
}

}  // namespace
}  // namespace km
