#include <yaml-cpp/yaml.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <string>
#include <thread>

#include "modules/core/bytes.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/support/command.hpp"
#include "test/support/patience.hpp"
#include "test/support/process.hpp"
#include "test/support/temporary_folder.hpp"

// kimera_multi_simulate as a program, on the smallest possible recordings.

namespace km {
namespace {

namespace fs = std::filesystem;

const std::string kProgram = std::string(KM_BIN_DIR) + "/kimera_multi_simulate";
const std::string kSmall =
    " --world vicon_room --robots 2 --duration 0.5 --resolution 64x48 --depth --depth-rate 10 "
    "--labels --color";
constexpr std::size_t kFrames = 10;  // for each robot

CommandResult simulate(const std::string& arguments, const fs::path& output) {
  return run_command(kProgram + arguments + " --output " + output.string());
}

// Every file below `folder` with its bytes.
std::map<std::string, std::string> contents(const TemporaryFolder& folder,
                                            const std::string& name) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path() / name))
    if (entry.is_regular_file()) {
      const std::string path = fs::relative(entry.path(), folder.path() / name).string();
      files[path] = folder.read(name + '/' + path);
    }
  return files;
}

std::size_t file_count(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

void wait_for_file(const fs::path& file) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!fs::exists(file) && std::chrono::steady_clock::now() < deadline)
    std::this_thread::yield();
  REQUIRE(fs::exists(file));
}

void check_equal(const std::map<std::string, std::string>& a,
                 const std::map<std::string, std::string>& b) {
  CHECK(a.size() == b.size());
  for (const auto& [path, bytes] : a) {
    CAPTURE(path);
    REQUIRE(b.contains(path));
    CHECK(b.at(path) == bytes);
  }
}

}  // namespace

TEST_CASE("The ordinary reader reads a recording, and files that went missing are made again",
          "[simulate]") {
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "r";
  const auto result = simulate(kSmall, output);
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  EurocReader reader = open_euroc(output / "robot1");
  std::size_t frames = 0;
  std::size_t samples = 0;
  while (const auto packet = reader.next()) {
    ++frames;
    samples += packet->imu.size();
    CHECK(packet->frame->left.width == 64);
  }
  CHECK(frames == kFrames);
  CHECK(samples > 200 + 95);  // 1 s before the first image, 0.475 s with images, 200 Hz
  CHECK(reader.report().empty());
  const fs::path mav0 = output / "robot1/mav0";
  CHECK(file_count(mav0 / "depth0/data") == kFrames / 2);
  CHECK(file_count(mav0 / "label0/data") == kFrames);
  CHECK(file_count(mav0 / "color0/data") == kFrames);
  for (const char* file :
       {"world.ply", "objects.json", "team.yaml", "README.md", "label_palette.csv"})
    CHECK(fs::exists(output / file));

  const auto whole = contents(folder, "r");
  CHECK_THAT(simulate(kSmall, output).output, Catch::Contains("complete already; nothing to do"));
  fs::remove_all(output / "robot1/mav0/cam1/data");
  fs::resize_file(output / "robot0/mav0/cam0/data/1001000000000.jpg", 100);
  fs::remove(output / "team.yaml");
  const auto again = simulate(kSmall, output);
  CAPTURE(again.output);
  CHECK(again.exit_code == 0);
  CHECK_THAT(again.output, Catch::Contains(": 12 files are missing"));
  check_equal(contents(folder, "r"), whole);
}

TEST_CASE("At level 0 a recording has the bytes of a program without effects", "[simulate]") {
  const TemporaryFolder folder;
  REQUIRE(simulate(kSmall, folder.path() / "plain").exit_code == 0);
  REQUIRE(simulate(kSmall + " --difficulty 0", folder.path() / "level").exit_code == 0);
  check_equal(contents(folder, "plain"), contents(folder, "level"));
  std::uint64_t hash = kFnv1aBasis;
  for (const auto& [path, bytes] : contents(folder, "plain/robot1"))
    for (const char c : path + bytes) mix_fnv1a(hash, std::uint64_t{static_cast<std::uint8_t>(c)});
      // A program without effects made these pixels. The bytes are those of the PNG and JPEG
      // libraries of Debian 12. The program of another compiler makes other bytes.
#ifdef __clang__
  CHECK(hash == 0xaa9633e41f2744b1ULL);
#else
  CHECK(hash == 0x2528fc838d7b433bULL);
#endif
  CHECK_FALSE(fs::exists(folder.path() / "plain/effects.yaml"));
  CHECK_FALSE(fs::exists(folder.path() / "plain/robot0/truth"));
}

TEST_CASE("At the hardest level the reader reads the recording, and the truth is beside it",
          "[simulate]") {
  const TemporaryFolder folder;
  const std::string hard =
      kSmall + " --difficulty 4 --set timing.dropped_share=0.4 traffic.people=3 ";
  REQUIRE(simulate(hard + "--threads 3", folder.path() / "a").exit_code == 0);
  REQUIRE(simulate(hard + "--threads 1", folder.path() / "b").exit_code == 0);
  check_equal(contents(folder, "a"), contents(folder, "b"));
  const fs::path robot = folder.path() / "a/robot1";
  EurocReader reader = open_euroc(robot);
  std::size_t frames = 0;
  while (const auto packet = reader.next()) ++frames;
  CHECK(frames > 0);
  CHECK(frames < kFrames);
  CHECK(frames == file_count(robot / "mav0/cam0/data"));
  CHECK(reader.report().empty());
  for (const char* file : {"a/effects.yaml", "a/traffic.csv", "a/robot1/truth/errors.yaml",
                           "a/robot1/truth/image_times.csv"})
    CHECK(fs::exists(folder.path() / file));
  // The level has a focal length that is wrong by 1 %.
  const auto focal_px = [&](const std::string& file) {
    return YAML::Load(folder.read("a/robot1/" + file))["intrinsics"][0].as<double>();
  };
  const double ratio = focal_px("mav0/cam0/sensor.yaml") / focal_px("truth/cam0.yaml");
  CHECK(std::abs(ratio - 1.0) == Approx(0.01).epsilon(1e-6));
}

TEST_CASE("A full disk leaves no incomplete file, and the run continues later", "[simulate]") {
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "full";
  // Files beyond 2 blocks of 512 bytes cannot be written: the calibration can, tables cannot.
  const auto result = run_command("trap '' XFSZ; ulimit -f 2; " + kProgram + kSmall + " --output " +
                                  output.string());
  CAPTURE(result.output);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Catch::Contains("cannot be written: File too large") &&
                                Catch::Contains(output.string()));
  CHECK_FALSE(fs::exists(output / "robot0/mav0/cam0/data.csv"));
  for (const auto& entry : fs::recursive_directory_iterator(output))
    CHECK(entry.path().extension() != ".part");

  REQUIRE(simulate(kSmall + " --threads 3", output).exit_code == 0);
  REQUIRE(simulate(kSmall + " --threads 1", folder.path() / "whole").exit_code == 0);
  check_equal(contents(folder, "full"), contents(folder, "whole"));
}

TEST_CASE("A run that is stopped continues to the same bytes", "[simulate]") {
  const TemporaryFolder folder;
  const std::string arguments =
      " --world vicon_room --robots 1 --duration 20 --resolution 64x48 --output ";
  const fs::path stopped = folder.path() / "stopped";
  Process program({"/bin/sh", "-c", "exec " + kProgram + arguments + stopped.string()});
  REQUIRE(program.wait_for_prefix("0 of 400 frames"));
  wait_for_file(stopped / "robot0/mav0/cam0/data/1001100000000.jpg");  // the third
  program.kill(SIGINT);
  CHECK(program.wait() == 130);
  CHECK(program.lines("Stopped; the same command continues").size() == 1);
  CHECK_FALSE(fs::exists(stopped / "robot0/mav0/cam0/data.csv"));  // not yet a recording
  CHECK_THROWS_AS(open_euroc(stopped / "robot0"), DatasetError);

  REQUIRE(run_command(kProgram + arguments + stopped.string()).exit_code == 0);
  REQUIRE(run_command(kProgram + arguments + (folder.path() / "whole").string()).exit_code == 0);
  check_equal(contents(folder, "stopped"), contents(folder, "whole"));
}

// A simulation that has received one signal while it prepares its world.
struct InterruptedPreparation {
  TemporaryFolder folder;
  Process program{{kProgram, "--world", "city", "--robots", "1", "--duration", "60", "--output",
                   (folder.path() / "city").string()}};

  InterruptedPreparation() {
    REQUIRE(program.wait_for_prefix("Preparing world city ..."));
    program.kill(SIGINT);
    REQUIRE(program.wait_for_prefix("Stopping after this step"));
  }
};

TEST_CASE("A signal ends the preparation in order", "[simulate]") {
  InterruptedPreparation preparation;
  Process& program = preparation.program;
  CHECK(program.wait() == 130);
  CHECK(program.lines("Stopped; the same command continues").size() == 1);
  CHECK(program.lines("0 of ").empty());
}

TEST_CASE("A second signal ends the preparation at once", "[simulate]") {
  bool ended_by_signal = false;
  // On a busy computer the step may end before the second signal arrives.
  for (int attempt = 0; attempt < 5 && !ended_by_signal; ++attempt) {
    InterruptedPreparation preparation;
    Process& program = preparation.program;
    program.kill(SIGINT);
    ended_by_signal = program.wait() == -SIGINT;  // which shells call 130
    CHECK(program.lines("Stopped").empty() == ended_by_signal);
  }
  CHECK(ended_by_signal);
}

TEST_CASE("Recordings with other parameters are refused", "[simulate]") {
  const TemporaryFolder folder;
  folder.write("simulation.json",
               "{\"generator\": \"g\", \"parameters\": {\"world\": \"camp\"}, "
               "\"finished_robots\": [], \"complete\": false}");
  const auto result = simulate(kSmall, folder.path());
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Catch::Contains("world: camp there, vicon_room asked for"));
}

TEST_CASE("Bad arguments exit with 1 and help with 0", "[simulate]") {
  CHECK(run_command(kProgram + " --world mars --output x").exit_code == 1);
  CHECK(run_command(kProgram).exit_code == 1);
  const auto help = run_command(kProgram + " --help");
  CHECK(help.exit_code == 0);
  CHECK_THAT(help.output, Catch::Contains("Examples:"));
}

}  // namespace km
