#include <CLI/CLI.hpp>

#include "apps/lab/simulate/effects.hpp"
#include "apps/lab/simulate/simulation_options.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

SimulationOptions parse(std::vector<std::string> arguments) {
  CLI::App app;
  SimulationOptions options;
  define(app, options);
  std::ranges::reverse(arguments);  // as CLI11 expects words
  app.parse(std::move(arguments));
  return options;
}

std::string refusal_of_options(const std::vector<std::string>& arguments) {
  std::vector<std::string> all = {"--world", "city", "--output", "x"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  try {
    parse(all);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

TEST_CASE("An RGB-D rig has depth at the images' rate") {
  const auto options = parse({"--world", "camp", "--rig", "rgbd", "--rate", "15", "--resolution",
                              "376x240", "--output", "x"});
  CHECK(options.cameras == CameraKind::kRgbd);
  CHECK(options.depth);
  CHECK(options.depth_rate_hz == 15.0);
  CHECK(options.width == 376);
  CHECK(options.height == 240);
}

TEST_CASE("Bad arguments are refused with their name and value") {
  struct Row {
    std::vector<std::string> words;
    const char* message;
  };
  const Row row = GENERATE(
      Row{{"--resolution", "752"}, "752 is not WIDTHxHEIGHT"},
      Row{{"--resolution", "8x8"}, "from 16 to 8192"}, Row{{"--robots", "0"}, "robots = "},
      Row{{"--rate", "nan"}, "rate = "}, Row{{"--duration", "-5"}, "duration = "},
      Row{{"--rig", "mono"}, "rgbd"}, Row{{"--seed", "-1"}, "seed = "},
      Row{{"--depth", "--depth-rate", "7"}, "--rate 20 is not a multiple of --depth-rate 7"},
      Row{{"--depth-rate", "5"}, "--depth-rate needs --depth"},
      Row{{"--names", "a"}, "need --trajectory"},
      Row{{"--set", "timing.drift=7"}, "unknown key timing.drift"},
      Row{{"--set", "sensor.dirt=7"}, "sensor.dirt = 7 is outside 0 .. 1"},
      Row{{"--set", "dirt=1"}, "not of the form section.key=value"},
      Row{{"--difficulty", "4"}, "difficulty = 4"});
  CAPTURE(row.words);
  CHECK_THAT(refusal_of_options(row.words), Contains(row.message));
}

TEST_CASE("Recorded motion needs a pair of files for each robot") {
  const TemporaryFolder folder;
  const std::string a = folder.write("V1_02_medium.csv.gz", "").string();
  const std::string b =
      folder.write("V1_03/mav0/state_groundtruth_estimate0/data.csv", "").string();
  CHECK_THAT(refusal_of_options({"--trajectory", a, b, "--imu", a}),
             Contains("--trajectory names 2 files, --imu 1"));
  CHECK_THAT(refusal_of_options({"--trajectory", a, a, "--imu", a, a}),
             Contains("named V1_02_medium"));
  CHECK_THAT(refusal_of_options({"--trajectory", a, "--imu", a, "--names", "a", "b"}),
             Contains("one name per --trajectory"));
  CHECK_THAT(refusal_of_options({"--trajectory", a, "--imu", a, "--names", "../a"}),
             Contains("'../a'"));
  const auto options =
      parse({"--world", "vicon_room", "--output", "x", "--trajectory", a, b, "--imu", a, b});
  CHECK(options.names == std::vector<std::string>{"V1_02_medium", "V1_03"});
  CHECK(options.robots == 2);
}

TEST_CASE("All errors of a file of options are reported by line") {
  const TemporaryFolder folder;
  const std::string file =
      folder.write("bad.yaml", "# a city\nworld: citty\nsped: 3\nrate: fast  # Hz\ndepth: maybe\n")
          .string();
  CHECK_THAT(refusal_of_options({"--config", file, "--robots", "0"}),
             Contains(file + ":4: rate = fast is not a number, 0.1 .. 200") &&
                 Contains(file + ":5: depth = maybe is not true or false") &&
                 Contains(file + ":3: unknown key sped (did you mean seed?)") &&
                 Contains("command line: robots = 0 is outside 1 .. 99") &&
                 !Contains("citty"));  // the command line says city
  CHECK_THAT(refusal_of_options({"--config", folder.write("c.yaml", "robots: [2\n").string()}),
             Contains("c.yaml:2: not YAML"));
  CHECK_THAT(
      refusal_of_options({"--config", "nowhere.yaml"}),
      Contains("no file nowhere.yaml, and none of this name in simulation: camp, city, demo"));
}

TEST_CASE("The files of options that come with the program can be used") {
  const std::string name = GENERATE("city", "camp", "demo");
  const auto options = parse({"--config", "config/simulation/" + name + ".yaml", "--output", "x"});
  CHECK(options.robots == 3);
}

TEST_CASE("Each level is harder than the one before, and level 0 has no effects") {
  const Effects none = load_effects(0, {});
  CHECK(none.inertial.gyro_scale == 0.0);
  CHECK(none.timing.dropped_share == 0.0);
  CHECK(none.traffic.cars == 0);
  CHECK_FALSE(parse({"--world", "city", "--output", "x"}).is_disturbed());
  for (int level = 1; level <= kHardestLevel; ++level) {
    CAPTURE(level);
    const Effects before = load_effects(level - 1, {}), here = load_effects(level, {});
    CHECK(here.sensor.rolling_shutter_s > before.sensor.rolling_shutter_s);
    CHECK(here.sensor.dirt > before.sensor.dirt);
    CHECK(here.inertial.gyro_scale > before.inertial.gyro_scale);
    CHECK(here.calibration_error.focal_share > before.calibration_error.focal_share);
    CHECK(here.timing.dropped_share > before.timing.dropped_share);
    CHECK(here.traffic.people > before.traffic.people);
  }
}

TEST_CASE("A single key has priority over the level") {
  const TemporaryFolder folder;
  const std::string file =
      folder.write("a.yaml", "difficulty: 2\nset: [sensor.dirt=0.7]\n").string();
  CHECK(parse({"--config", file, "--world", "city", "--output", "x"}).effects.sensor.dirt == 0.7);
  const auto options = parse({"--config", file, "--set", "sensor.glare=0", "timing.drift_ppm=7",
                              "--robots", "2", "--world", "camp", "--output", "x"});
  CHECK(options.effects.sensor.glare == 0.0);
  CHECK(options.effects.timing.drift_ppm == 7.0);
  CHECK(options.effects.sensor.rolling_shutter_s == 0.015);
  CHECK(options.robots == 2);
  CHECK(options.is_disturbed());
}

}  // namespace
}  // namespace km
