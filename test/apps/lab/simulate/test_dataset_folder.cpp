#include <catch2/catch.hpp>
#include <filesystem>

#include "apps/lab/simulate/dataset_folder.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

const DatasetRecord kWanted = {"simulator 1", {{"world", "city"}, {"seed", "1"}}, {}, false};

std::string refusal(const fs::path& folder, const DatasetRecord& wanted = kWanted) {
  try {
    DatasetFolder opened(folder, wanted);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("A new folder is made and stores the finished robots", "[simulate]") {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "new/recordings";
  {
    DatasetFolder opened(path, kWanted);
    CHECK_FALSE(opened.is_resumed());
    opened.mark_finished("robot1");
    opened.mark_finished("robot0");
    opened.mark_finished("robot1");
  }
  CHECK_THAT(folder.read("new/recordings/simulation.json"),
             Catch::Contains("\"robot0\",\n    \"robot1\"\n"));
  DatasetFolder again(path, kWanted);
  CHECK(again.is_resumed());
  CHECK_FALSE(again.is_complete());
  again.mark_complete();
  CHECK(again.is_complete());
}

TEST_CASE("Folders of others are refused", "[simulate]") {
  const TemporaryFolder folder;
  folder.write("thesis.tex", "");
  CHECK_THAT(refusal(folder.path()),
             Catch::Contains("not made by this program") && Catch::Contains("another --output"));
  CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("A folder with other parameters is refused by naming them", "[simulate]") {
  const TemporaryFolder folder;
  CHECK(refusal(folder.path()).empty());
  DatasetRecord other = kWanted;
  other.parameters[1] = {"seed", "2"};
  const std::string message = refusal(folder.path(), other);
  CHECK_THAT(message,
             Catch::Contains("seed: 1 there, 2 asked for") && Catch::Contains("another --output"));
}

TEST_CASE("A damaged record is named", "[simulate]") {
  const TemporaryFolder folder;
  const auto* const text = GENERATE("{\"generator\": ", "", "[1, 2]", "{\"generator\": \"x\"}");
  CAPTURE(text);
  folder.write("simulation.json", text);
  CHECK_THAT(refusal(folder.path()), Catch::Contains("simulation.json: cannot be understood"));
}

TEST_CASE("Two runs cannot write to one folder", "[simulate]") {
  const TemporaryFolder folder;
  const DatasetFolder first(folder.path(), kWanted);
  CHECK_THAT(refusal(folder.path()), Catch::Contains("another run is writing to it"));
}

TEST_CASE("A place that cannot be written is named", "[simulate]") {
  const TemporaryFolder folder;
  const fs::path below_file = folder.write("file", "") / "recordings";
  CHECK_THAT(refusal(below_file), Catch::Contains(below_file.string()));
  CHECK_THAT(refusal("/proc/recordings"), Catch::Contains("/proc/recordings: cannot be made"));
}

}  // namespace km
