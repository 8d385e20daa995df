#include "test/support/command.hpp"
#include "test/support/euroc_copy.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

constexpr std::size_t kImages = 40;  // 2 s

// The first images of MH_01_easy, and the inertial samples from 5 s before them to 0.5 s after.
EurocCopy excerpt(const fs::path& recording) {
  EurocCopy copy(recording);
  for (auto& images : copy.cameras) images.resize(kImages);
  copy.samples.resize(1499);
  return copy;
}

constexpr std::size_t kImage = 24, kSample = 1199;  // items to corrupt, in the middle
constexpr Stamp kDay = 86'400'000'000'000;

struct Fault {
  std::string name;
  std::function<void(EurocCopy&)> corrupt;     // lists
  std::function<void(const fs::path&)> spoil;  // an image
  std::size_t poses;                           // 0: not checked
  std::string message;                         // with file and line
};

std::vector<Fault> faults() {
  const auto no_list = [](EurocCopy&) {};
  const auto no_image = [](const fs::path&) {};
  return {
      {"a 65535 x 65535 PNG header", no_list,
       [](const fs::path& image) {
         fs::remove(image);
         std::ofstream(image, std::ios::binary)
             << std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xff\xff\0\0\xff\xff\x08\0\0\0\0", 29)
             << "IEND";
       },
       kImages - 1, "1 images of the wrong size, first: "},
      {"a gyroscope at 1e300",
       [](EurocCopy& copy) {
         std::string& values = copy.samples[kSample].values;
         values.replace(0, values.find(','), "1e300");
       },
       no_image, kImages, "imu0/data.csv line 1201: 1e+300 rad/s (at most 100)"},
      {"an inertial stamp a day ahead",
       [](EurocCopy& copy) { copy.samples[kSample].stamp += kDay; }, no_image, kImages,
       "imu0/data.csv line 1201: "},
      {"an image's stamp a day ahead",
       [](EurocCopy& copy) {
         for (auto& images : copy.cameras) images[kImage].stamp += kDay;
       },
       no_image, kImages - 1, "2 stamps out of order, first: "},
      {"an image that is a link to itself", no_list,
       [](const fs::path& image) {
         fs::remove(image);
         fs::create_symlink(image.filename(), image);
       },
       kImages - 1, "no such image: Too many levels of symbolic links"},
      {"inertial samples that end in the middle",
       [](EurocCopy& copy) {
         copy.samples.erase(copy.samples.begin() + kSample, copy.samples.end() - 1);
         copy.samples.back().stamp += 5'000'000'000;
       },
       no_image, 0, "1 gaps between inertial samples"},
  };
}

}  // namespace

TEST_CASE("A robot skips broken parts of its recording, reports them, and continues") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  for (const Fault& fault : faults()) {
    CAPTURE(fault.name);
    const TemporaryFolder folder;
    EurocCopy copy = excerpt(*recording);
    const EurocCopy::Image image = copy.cameras[0][kImage];
    const std::string name = std::to_string(image.stamp) + image.file.extension().string();
    fault.corrupt(copy);
    copy.write(folder.path() / "recording");
    fault.spoil(folder.path() / "recording/mav0/cam0/data" / name);
    const CommandResult result = succeeded(
        run_command(euroc_robot(0, "--rate max --serve-limit 0 --interface lo --dataset " +
                                       (folder.path() / "recording").string() + " --output " +
                                       (folder.path() / "results").string())));
    CHECK_THAT(result.output, Contains(fault.message));
    if (fault.poses > 0) CHECK(line_count(folder.path() / "results/odometry.tum") == fault.poses);
  }
}

TEST_CASE("Bad input and configuration end a robot with one clear message") {
  const TemporaryFolder folder;
  const std::string robot =
      KM_BIN_DIR "/kimera_multi_robot --robot 1 --output " + (folder.path() / "out").string();
  const auto fails_with = [&](const std::string& arguments, int code, const std::string& text) {
    const CommandResult result = run_command(robot + ' ' + arguments);
    CAPTURE(arguments, result.output);
    CHECK(result.exit_code == code);
    CHECK(result.output.find(text) != std::string::npos);
  };
  const std::string empty = folder.path().string();
  fails_with("--dataset " + empty, 1, "cam0");
  fails_with("--dataset " + empty + " --rate fast", 2, "neither a positive number nor max");
  fails_with("", 2, "--dataset");
  fails_with("--dataset " + empty + " --resume " + empty + "/alcie", 1,
             "alcie: no such folder; --output");
  fails_with("--dataset " + empty + " --set pcm.confidence=2", 2, "pcm.confidence");
  fails_with("--dataset " + empty + " --link carrier_pigeon", 1, "carrier_pigeon");
  const auto typo = folder.write("typo.yaml", "vio:\n  iteratons: 3\n");
  fails_with("--dataset " + empty + " --config " + typo.string(), 1, "typo.yaml:2");
  const auto graph = folder.write("bad.g2o", "EDGE_SE3:QUAT 0 1 nan\n");
  fails_with("--graph " + graph.string(), 1, "bad.g2o:1");
  CHECK_FALSE(fs::exists(folder.path() / "out" / "odometry.tum"));
}

TEST_CASE("A folder that results cannot go to is refused before any other output") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  const auto refusal = [&](const fs::path& output) {
    const CommandResult result = run_command(euroc_robot(
        0, "--interface lo --dataset " + recording->string() + " --output " + output.string()));
    CHECK(result.exit_code == 1);
    return result.output;
  };
  const fs::path none = folder.write("file", "") / "results";
  CHECK(refusal(none) == "kimera_multi_robot: " + none.string() +
                             ": cannot be written to: Not a directory; choose another folder for "
                             "the results\n");
  const fs::path map = folder.write("map.yaml", "mine");  // no run has written it
  CHECK_THAT(refusal(folder.path()),
             Contains(map.string() + ": would be replaced") && Contains("choose another folder"));
  CHECK(folder.read("map.yaml") == "mine");
}

}  // namespace km
