#include <algorithm>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "apps/lab/simulate/simulation_options.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

SimulationOptions parse(std::vector<std::string> arguments) {
  CLI::App app;
  SimulationOptions options;
  define(app, options);
  std::ranges::reverse(arguments);  // CLI11 takes them from the end
  app.parse(std::move(arguments));
  return completed(options);
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

}  // namespace

TEST_CASE("A short command has sensible defaults", "[simulate]") {
  const auto options = parse({"--world", "vicon_room", "--output", "x"});
  CHECK(options.world == WorldKind::kViconRoom);
  CHECK(options.names == std::vector<std::string>{"robot0", "robot1", "robot2"});
  CHECK(options.width == 752);
  CHECK(options.height == 480);
  CHECK_FALSE(options.depth);
  CHECK(options.threads >= 1);
}

TEST_CASE("An RGB-D rig has depth at the images' rate", "[simulate]") {
  const auto options = parse({"--world", "camp", "--rig", "rgbd", "--rate", "15", "--resolution",
                              "376x240", "--output", "x"});
  CHECK(options.cameras == CameraKind::kRgbd);
  CHECK(options.depth);
  CHECK(options.depth_rate_hz == 15.0);
  CHECK(options.width == 376);
  CHECK(options.height == 240);
}

TEST_CASE("Bad arguments are refused with their name and value", "[simulate]") {
  CHECK_THAT(refusal_of_options({"--resolution", "752"}),
             Catch::Contains("752 is not WIDTHxHEIGHT"));
  CHECK_THAT(refusal_of_options({"--resolution", "8x8"}), Catch::Contains("from 16 to 8192"));
  CHECK_THAT(refusal_of_options({"--resolution", "752x480x3"}),
             Catch::Contains("command line: resolution = "));
  CHECK_THAT(refusal_of_options({"--robots", "0"}), Catch::Contains("command line: robots = "));
  CHECK_THAT(refusal_of_options({"--rate", "nan"}), Catch::Contains("command line: rate = "));
  CHECK_THAT(refusal_of_options({"--duration", "-5"}),
             Catch::Contains("command line: duration = "));
  CHECK_THAT(refusal_of_options({"--rig", "mono"}),
             Catch::Contains("mono") && Catch::Contains("rgbd"));
  CHECK_THAT(refusal_of_options({"--seed", "-1"}), Catch::Contains("command line: seed = "));
  CHECK_THAT(refusal_of_options({"--image-format", "bmp"}), Catch::Contains("bmp"));
  CHECK_THAT(refusal_of_options({"--depth", "--depth-rate", "7"}),
             Catch::Contains("--rate 20 is not a multiple of --depth-rate 7"));
  CHECK_THAT(refusal_of_options({"--ideal-depth"}), Catch::Contains("--ideal-depth need --depth"));
  CHECK_THAT(refusal_of_options({"--start", "3"}), Catch::Contains("need --trajectory"));
  CHECK_THAT(refusal_of_options({"--trajectory", "/nowhere.csv"}), Catch::Contains("/nowhere.csv"));
}

TEST_CASE("Recorded motion needs a pair of files for each robot", "[simulate]") {
  const TemporaryFolder folder;
  const std::string a = folder.write("V1_02_medium.csv.gz", "").string();
  const std::string b =
      folder.write("V1_03/mav0/state_groundtruth_estimate0/data.csv", "").string();
  CHECK_THAT(refusal_of_options({"--trajectory", a, b, "--imu", a}),
             Catch::Contains("--trajectory names 2 files, --imu 1"));
  CHECK_THAT(refusal_of_options({"--trajectory", a, a, "--imu", a, a}),
             Catch::Contains("named V1_02_medium"));
  CHECK_THAT(refusal_of_options({"--trajectory", a, "--imu", a, "--names", "a", "b"}),
             Catch::Contains("one name per --trajectory"));
  CHECK_THAT(refusal_of_options({"--trajectory", a, "--imu", a, "--names", "../a"}),
             Catch::Contains("'../a'"));
  CHECK_THAT(refusal_of_options({"--trajectory", a, "--imu", a, "--start", "9", "--end", "8"}),
             Catch::Contains("--end is not after --start"));
  const auto options =
      parse({"--world", "vicon_room", "--output", "x", "--trajectory", a, b, "--imu", a, b});
  CHECK(options.names == std::vector<std::string>{"V1_02_medium", "V1_03"});
  CHECK(options.robots == 2);
}

TEST_CASE("Recorded motion may come from another rig", "[simulate]") {
  const TemporaryFolder folder;
  const std::string flight = folder.write("room1.csv", "").string();
  std::string camera =
      "  camera_model: pinhole\n  distortion_model: equidistant\n"
      "  distortion_coeffs: [0.003, 0.0007, -0.002, 0.0002]\n"
      "  intrinsics: [190.9, 190.9, 254.9, 256.9]\n  resolution: [512, 510]\n";
  const std::string chain =
      folder
          .write("camchain.yaml",
                 "cam0:\n  T_cam_imu: [[1,0,0,0], [0,1,0,0], [0,0,1,0], [0,0,0,1]]\n" + camera +
                     "cam1:\n  T_cam_imu: [[1,0,0,-0.1], [0,1,0,0], [0,0,1,0], [0,0,0,1]]\n" +
                     camera)
          .string();
  const std::vector<std::string> recorded = {"--world",      "vicon_room", "--output", "x",
                                             "--trajectory", flight,       "--imu",    flight};
  CHECK_FALSE(parse(recorded).rig.has_value());
  std::vector<std::string> words = recorded;
  words.insert(words.end(), {"--calibration", chain});
  const auto options = parse(words);
  REQUIRE(options.rig.has_value());
  CHECK(options.rig->stereo.cameras[0].lens.model() == LensModel::kEquidistant);
  CHECK(options.width == 512);
  CHECK(options.height == 510);
  CHECK_THAT(command_line(options), Catch::Contains(" --calibration camchain.yaml"));
  CHECK_THAT(refusal_of_options({"--calibration", chain}),
             Catch::Contains("--calibration, --names"));
  words.back() = flight;
  CHECK_THROWS_WITH(parse(words), Catch::Contains("room1.csv"));
}

TEST_CASE("Options may come from a file, and the command line has the last word", "[simulate]") {
  const TemporaryFolder folder;
  const std::string file =
      folder
          .write("a.yaml",
                 "world: camp  # tents\nlabels: true\nresolution: 64x48\nduration: 12.5\n")
          .string();
  const auto options = parse({"--config", file, "--duration", "7", "--output", "x"});
  CHECK(options.world == WorldKind::kCamp);
  CHECK(options.labels);
  CHECK(options.width == 64);
  CHECK(options.duration_s == 7.0);
}

TEST_CASE("All errors of a file of options are reported by line", "[simulate]") {
  const TemporaryFolder folder;
  const std::string file =
      folder.write("bad.yaml", "# a city\nworld: citty\nsped: 3\nrate: fast  # Hz\ndepth: maybe\n")
          .string();
  CHECK_THAT(refusal_of_options({"--config", file, "--robots", "0"}),
             Catch::Contains(file + ":4: rate = fast is not a number, 0.1 .. 200") &&
                 Catch::Contains(file + ":5: depth = maybe is not true or false") &&
                 Catch::Contains(file + ":3: unknown key sped (did you mean seed?)") &&
                 Catch::Contains("command line: robots = 0 is outside 1 .. 99") &&
                 !Catch::Contains("citty"));  // the command line says city
  CHECK_THAT(refusal_of_options({"--config", folder.write("c.yaml", "robots: [2\n").string()}),
             Catch::Contains("c.yaml:2: not YAML"));
  CHECK_THAT(refusal_of_options({"--config", "nowhere.yaml"}),
             Catch::Contains("nowhere.yaml: cannot open"));
}

TEST_CASE("The files of options that come with the program can be used", "[simulate]") {
  const std::string name = GENERATE("city", "camp", "demo");
  const auto options = parse({"--config", "config/simulation/" + name + ".yaml", "--output", "x"});
  CHECK(options.robots == 3);
}

TEST_CASE("Threads and the place of the output are no parameters of the bytes", "[simulate]") {
  const auto a = parse({"--world", "city", "--output", "a", "--threads", "1"});
  const auto b = parse({"--world", "city", "--output", "b", "--threads", "7"});
  CHECK(parameters(a) == parameters(b));
  CHECK(command_line(a) == command_line(b));
  CHECK(parameters(a) != parameters(parse({"--world", "city", "--output", "a", "--seed", "2"})));
  CHECK(parameters(a) != parameters(parse({"--world", "city", "--output", "a", "--labels"})));
}

TEST_CASE("The command in the README makes the same recordings", "[simulate]") {
  const auto options = parse({"--world", "city", "--output", "DIR", "--rig", "rgbd", "--labels",
                              "--duration", "12.5", "--image-format", "png", "--depth-rate", "5"});
  std::istringstream command(command_line(options));
  std::vector<std::string> words(std::istream_iterator<std::string>(command), {});
  words.erase(words.begin());
  CHECK(parameters(parse(words)) == parameters(options));
}

}  // namespace km
