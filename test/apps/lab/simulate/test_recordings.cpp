#include <yaml-cpp/yaml.h>
#include <zlib.h>

#include "apps/lab/simulate/dataset_record.hpp"
#include "apps/lab/simulate/robot_scenario.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// kimera_multi_simulate as a program, on the smallest possible recordings.

const std::string kProgram = std::string(KM_BIN_DIR) + "/kimera_multi_simulate";
const std::string kSmall =
    " --world vicon_room --robots 2 --duration 0.5 --resolution 64x48 --depth --depth-rate 10 "
    "--labels";
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

void check_equal(const std::map<std::string, std::string>& a,
                 const std::map<std::string, std::string>& b) {
  CHECK(a.size() == b.size());
  for (const auto& [path, bytes] : a) {
    CAPTURE(path);
    REQUIRE(b.contains(path));
    CHECK(b.at(path) == bytes);
  }
}

TEST_CASE("The ordinary reader reads a recording, and missing images are made again") {
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "r";
  const auto result = succeeded(simulate(kSmall, output));
  FolderReader reader = open_folder(output / "robot1");
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
  for (const char* file : {"world.ply", "objects.json", "label_palette.csv"})
    CHECK(fs::exists(output / file));
  CHECK_THAT(folder.read("r/team.yaml"),
             Contains("mapping.mode=semantic, --set, semantic_mapping.voxel_size_m=0.05, "
                      "--set, vio.drift_rotation=2e-4") &&
                 Contains("truth: \"robot1/mav0/state_groundtruth_estimate0/data.csv\""));

  const auto whole = contents(folder, "r");
  CHECK_THAT(simulate(kSmall, output).output, Contains("complete already; nothing to do"));
  // As a run leaves it that was stopped.
  std::string record = folder.read("r/simulation.json");
  CHECK_THAT(record, Contains("\"complete\": true"));  // as config/docker/entrypoint looks
  record.replace(record.rfind("true"), 4, "false");
  folder.write("r/simulation.json", record);
  fs::remove_all(output / "robot1/mav0/cam1/data");
  fs::resize_file(output / "robot0/mav0/cam0/data/1001000000000.jpg", 100);
  fs::remove(output / "team.yaml");
  CHECK(simulate(kSmall, output).exit_code == 0);
  check_equal(contents(folder, "r"), whole);
}

TEST_CASE("At the hardest level the reader reads the recording, with any number of threads") {
  const TemporaryFolder folder;
  const std::string hard =
      kSmall + " --difficulty 3 --set timing.dropped_share=0.4 traffic.people=3 ";
  REQUIRE(simulate(hard + "--threads 3", folder.path() / "a").exit_code == 0);
  REQUIRE(simulate(hard + "--threads 1", folder.path() / "b").exit_code == 0);
  check_equal(contents(folder, "a"), contents(folder, "b"));
  const fs::path robot = folder.path() / "a/robot1";
  FolderReader reader = open_folder(robot);
  std::size_t frames = 0;
  while (const auto packet = reader.next()) ++frames;
  CHECK(frames > 0);
  CHECK(frames < kFrames);
  CHECK(frames == file_count(robot / "mav0/cam0/data"));
  CHECK(reader.report().empty());
  // The level has a focal length that is wrong by 0.5 %.
  const double focal_px =
      YAML::Load(folder.read("a/robot1/mav0/cam0/sensor.yaml"))["intrinsics"][0].as<double>();
  CHECK(std::abs(focal_px / (458.654 * 64 / 752) - 1.0) == Approx(0.005).epsilon(1e-3));
}

const std::string kEuroc =
    "#timestamp,px,...\n"
    "1000,1,2,3,0.5,0.5,-0.5,0.5,4,5,6,7,8,9,10,11,12\n"
    "1000,1,2,3,0.5,0.5,-0.5,0.5,4,5,6,7,8,9,10,11,12\n"  // as published: a stamp twice
    "2000,1,2,4,0.5,0.5,-0.5,0.5,4,5,6,7,8,9,10,11,12\n";
const std::string kImu = "#t,gyro,accel\n900,1,2,3,4,5,6\n1900,1,2,3,4,5,7\n";

fs::path write_gzip(const TemporaryFolder& folder, const std::string& name,
                    const std::string& text) {
  const fs::path path = folder.path() / name;
  const gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
  gzclose(file);
  return path;
}

std::string refusal_of_flight(const std::string& truth, const std::string& imu) {
  const TemporaryFolder folder;
  const auto t = folder.write("truth.csv", truth);
  const auto i = folder.write("imu.csv", imu);
  try {
    (void)read_recorded_flight(t, i);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

TEST_CASE("Recorded states and samples are read, gzipped or not") {
  const TemporaryFolder folder;
  const bool zipped = GENERATE(false, true);
  const auto truth =
      zipped ? write_gzip(folder, "t.csv.gz", kEuroc) : folder.write("t.csv", kEuroc);
  const auto imu = zipped ? write_gzip(folder, "i.csv.gz", kImu) : folder.write("i.csv", kImu);
  const RecordedFlight flight = read_recorded_flight(truth, imu);
  REQUIRE(flight.truth.size() == 2);
  const TrueState& state = flight.truth[1];
  CHECK(state.stamp == 2000);
  CHECK(state.T_world_body.translation() == Eigen::Vector3d(1, 2, 4));
  const Eigen::Quaterniond q(0.5, 0.5, -0.5, 0.5);
  CHECK((state.T_world_body.linear() - q.toRotationMatrix()).norm() < 1e-15);
  CHECK(state.velocity_world == Eigen::Vector3d(4, 5, 6));
  CHECK(state.accel_bias == Eigen::Vector3d(10, 11, 12));
  REQUIRE(flight.imu.size() == 2);
  CHECK(flight.imu[1].accel == Eigen::Vector3d(4, 5, 7));
  CHECK_THAT(flight.fingerprint, Contains(truth.filename().string()));
}

TEST_CASE("Recordings that cannot be used are refused by file and line") {
  CHECK_THAT(refusal_of_flight(kEuroc + "3000,1,2,x,1,0,0,0\n", kImu),
             Contains("truth.csv line 5: x is not a finite number"));
  CHECK_THAT(refusal_of_flight(kEuroc + "3000,1,2,3,9,0,0,0\n", kImu),
             Contains("line 5") && Contains("norm"));
  CHECK_THAT(refusal_of_flight(kEuroc + "1500,1,2,3,1,0,0,0\n", kImu), Contains("line 5"));
  CHECK_THAT(refusal_of_flight(kEuroc, kImu + "2900,1,2\n"),
             Contains("imu.csv line 4: has only 3 fields"));
  CHECK_THAT(refusal_of_flight("", kImu), Contains("truth.csv: holds no data"));
  CHECK_THAT(refusal_of_flight(kEuroc, "9000,1,2,3,4,5,6\n9900,1,2,3,4,5,7\n"),
             Contains("do not overlap in time"));
}

const DatasetRecord kWanted = {"simulator 1", {{"world", "city"}, {"seed", "1"}}, false};

std::string refusal(const fs::path& folder, const DatasetRecord& wanted = kWanted) {
  try {
    (void)open_dataset(folder, wanted);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

TEST_CASE("A folder with other content or parameters is refused") {
  const TemporaryFolder folder;
  SECTION("files of others") {
    folder.write("thesis.tex", "");
    CHECK_THAT(refusal(folder.path()),
               Contains("not made by this program") && Contains("another --output"));
    CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);
  }
  SECTION("other parameters") {
    CHECK(refusal(folder.path()).empty());
    DatasetRecord other = kWanted;
    other.parameters = {{"world", "city"}, {"seed", "2"}, {"labels", "yes"}};
    CHECK_THAT(refusal(folder.path(), other), Contains("seed: 1 there, 2 asked for") &&
                                                  Contains("labels: none there, yes asked") &&
                                                  Contains("another --output"));
  }
  SECTION("a damaged record") {
    folder.write("simulation.json", GENERATE("{\"generator\": ", "", "[1, 2]", "{\"a\": \"x\"}"));
    CHECK_THAT(refusal(folder.path()), Contains("simulation.json: cannot be understood"));
  }
  SECTION("a place that cannot be written") {
    const fs::path below_file = folder.write("file", "") / "recordings";
    CHECK_THAT(refusal(below_file), Contains(below_file.string()));
  }
}

}  // namespace
}  // namespace km
