#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>
#include <string>

#include "apps/lab/simulate/effects.hpp"
#include "apps/lab/simulate/simulation_options.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

SimulationOptions parsed_effects(std::vector<std::string> arguments) {
  CLI::App app;
  SimulationOptions options;
  define(app, options);
  arguments.insert(arguments.end(), {"--world", "city", "--output", "x"});
  std::ranges::reverse(arguments);  // CLI11 takes them from the end
  app.parse(std::move(arguments));
  return completed(options);
}

std::string refusal_of_effects(const std::vector<std::string>& arguments) {
  try {
    parsed_effects(arguments);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("Level 0 has no effects", "[simulate]") {
  CHECK(key_texts(load_effects({})) == key_texts(Effects{}));
  const Effects none = parsed_effects({}).effects;
  CHECK(none.inertial.gyro_scale == 0.0);
  CHECK(none.timing.dropped_share == 0.0);
  CHECK(none.calibration_error.mounting_rad == 0.0);
  CHECK(none.sensor.rolling_shutter_s == 0.0);
  CHECK(none.traffic.cars == 0);
  CHECK_FALSE(none.sensor.motion_blur);
  for (const auto& [name, value] : parameters(parsed_effects({}))) {
    CHECK(name != "difficulty");
    CHECK(name.find('.') == std::string::npos);
  }
}

TEST_CASE("Each level is at least as hard as the one before", "[simulate]") {
  for (const LevelKey& row : level_table()) {
    CAPTURE(row.key);
    if (std::string(row.values[4]) == "true") continue;
    if (std::string(row.key) == "sensor.dirt_spots") continue;       // without effect at level 0
    if (std::string(row.key) == "sensor.passage_every_s") continue;  // 0 is never
    if (std::string(row.key) == "timing.jump_every_s") continue;
    for (std::size_t level = 1; level < row.values.size(); ++level)
      CHECK(std::stod(row.values[level]) >= std::stod(row.values[level - 1]));
  }
}

TEST_CASE("The README has the table of levels", "[simulate]") {
  std::ifstream file("apps/lab/simulate/README.md");
  std::ostringstream text;
  text << file.rdbuf();
  for (const LevelKey& row : level_table()) {
    std::string line = std::string("| `") + row.key + "` |";
    for (const char* value : row.values) line += std::string(" ") + value + " |";
    CHECK_THAT(text.str(), Catch::Contains(line));
  }
}

TEST_CASE("A single key has priority over the file, and the file over the level", "[simulate]") {
  const TemporaryFolder folder;
  const std::string file =
      folder
          .write("a.yaml",
                 "difficulty: 2\nsensor:\n  dirt: 0.7\n  glare: 0.9\ntraffic: {cars: 3}\n")
          .string();
  const auto options = parsed_effects(
      {"--config", file, "--set", "sensor.glare=0", "timing.drift_ppm=7", "--robots", "2"});
  CHECK(options.difficulty == 2);
  CHECK(options.effects.sensor.dirt == 0.7);
  CHECK(options.effects.sensor.glare == 0.0);
  CHECK(options.effects.traffic.cars == 3);
  CHECK(options.effects.timing.drift_ppm == 7.0);
  CHECK(options.effects.sensor.rolling_shutter_s == 0.015);
  CHECK(options.robots == 2);
}

TEST_CASE("Wrong effects are refused with their place", "[simulate]") {
  const TemporaryFolder folder;
  const std::string file =
      folder.write("a.yaml", "robots: 2\nsensor:\n  dirt: 7\nweather:\n  rain: 1\n").string();
  CHECK_THAT(refusal_of_effects({"--config", file, "--set", "timing.drift=7"}),
             Catch::Contains(file + ":3: sensor.dirt = 7 is outside 0 .. 1") &&
                 Catch::Contains(file + ":4: unknown section weather") &&
                 Catch::Contains("unknown key timing.drift"));
  CHECK_THAT(refusal_of_effects({"--set", "dirt=1"}),
             Catch::Contains("not of the form section.key=value"));
  CHECK_THAT(refusal_of_effects({"--difficulty", "5"}), Catch::Contains("difficulty = 5"));
}

TEST_CASE("The command in the README repeats level and single keys", "[simulate]") {
  const auto options = parsed_effects(
      {"--difficulty", "3", "--set", "sensor.glare=0", "traffic.cars=1", "--labels"});
  std::istringstream command(command_line(options));
  std::vector<std::string> words(std::istream_iterator<std::string>(command), {});
  words.erase(words.begin());
  words.erase(std::find(words.begin(), words.end(), "--world"),
              std::find(words.begin(), words.end(), "--world") + 2);
  words.erase(std::find(words.begin(), words.end(), "--output"), words.end());
  const auto again = parsed_effects(words);
  CHECK(parameters(again) == parameters(options));
  CHECK(key_texts(again.effects) == key_texts(options.effects));
  CHECK(parameters(options) != parameters(parsed_effects({"--difficulty", "3", "--labels"})));
}

}  // namespace km
