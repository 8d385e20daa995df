#include <catch2/catch.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "modules/place_recognition/vocabulary_file.hpp"
#include "test/modules/place_recognition/synthetic_orb.hpp"
#include "test/support/shared_data.hpp"

using Catch::Matchers::Contains;

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxShippedBytes = 1'500'000;

// A folder of its own for the files of one test.
class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(fs::temp_directory_path() / ("km_app_" + std::to_string(std::random_device{}()))) {
    fs::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

struct Run {
  int status;
  std::string output;
};

// Runs the tool; stdout and stderr together.
Run run_tool(const fs::path& folder, const std::string& arguments) {
  const fs::path log = folder / "log";
  const std::string command = std::string(KM_BIN_DIR) + "/kimera_multi_vocabulary " + arguments +
                              " > " + log.string() + " 2>&1";
  const int status = std::system(command.c_str());
  return {status, content(log)};
}

TEST_CASE("The shipped vocabulary loads, is the documented one, and is small",
          "[place_recognition]") {
  const fs::path file = "config/vocabulary/indoor.kmvoc";
  const Vocabulary vocabulary = load_vocabulary(file);
  CHECK_THAT(content("config/vocabulary/README.md"), Contains(fingerprint_text(vocabulary.id())));
  CHECK(fs::file_size(file) < kMaxShippedBytes);
  SyntheticOrb world(2, 1);
  const auto image = world.image(100, 5);
  CHECK(score(vocabulary.transform(image), vocabulary.transform(image)) ==
        Approx(1.0).margin(1e-5));
}

// checks.md L5 on real images, through the tool.
TEST_CASE("The tool trains on real images and tells the two places apart", "[place_recognition]") {
  const auto images = shared_data("kimera_vio_lcd");
  if (!images) return;
  const TemporaryFolder folder;
  const auto left = [&](int i) {
    return (*images / ("left_img_" + std::to_string(i) + ".png")).string();
  };
  const std::string vocabulary = (folder.path() / "v.kmvoc").string();
  const Run trained = run_tool(folder.path(), "train -k 9 -L 3 -o " + vocabulary + " " + left(0) +
                                                  " " + left(1) + " " + left(2) + " " + left(3));
  INFO(trained.output);
  REQUIRE(trained.status == 0);
  CHECK_THAT(trained.output, Contains("of 4 images"));

  const auto score_of = [&](int i, int k) {
    const fs::path json = folder.path() / "score.json";
    const Run run = run_tool(folder.path(), "inspect " + vocabulary + " --pair " + left(i) + " " +
                                                left(k) + " --json " + json.string());
    REQUIRE(run.status == 0);
    const std::string text = content(json);
    const std::string key = "\"pair_score\": ";
    return std::stod(text.substr(text.find(key) + key.size()));
  };
  CHECK(score_of(2, 2) == Approx(1.0).margin(1e-5));
  // 0, 1 and 2, 3 are pairs of one place each.
  CHECK(score_of(0, 1) > score_of(0, 2));
  CHECK(score_of(2, 3) > score_of(1, 3));
}

TEST_CASE("The tool names what it cannot use and fails", "[place_recognition]") {
  const TemporaryFolder folder;
  const auto check_fails = [&](const std::string& arguments, const char* reason) {
    const Run run = run_tool(folder.path(), arguments);
    CHECK(run.status != 0);
    CHECK_THAT(run.output, Contains(reason));
  };
  const std::string at = folder.path().string();
  check_fails("train -o " + at + "/v /nowhere", "/nowhere does not exist");
  check_fails("train -o " + at + "/v " + at, "holds no image");
  std::ofstream(folder.path() / "broken.png") << "no image";
  check_fails("train -o " + at + "/v " + at, "broken.png cannot be decoded");
  check_fails("train -k 1 -o " + at + "/v " + at + "/broken.png", "branching = 1 is outside");
  check_fails("inspect config/vocabulary/README.md", "not a vocabulary");
  check_fails("", "subcommand is required");
}

}  // namespace
}  // namespace km
