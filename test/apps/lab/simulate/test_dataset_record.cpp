#include <catch2/catch.hpp>
#include <filesystem>

#include "apps/lab/simulate/dataset_record.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

const DatasetRecord kWanted = {"simulator 1", {{"world", "city"}, {"seed", "1"}}, false};

std::string refusal(const fs::path& folder, const DatasetRecord& wanted = kWanted) {
  try {
    (void)open_dataset(folder, wanted);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("A folder with other content or parameters is refused", "[simulate]") {
  const TemporaryFolder folder;
  SECTION("files of others") {
    folder.write("thesis.tex", "");
    CHECK_THAT(refusal(folder.path()),
               Catch::Contains("not made by this program") && Catch::Contains("another --output"));
    CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);
  }
  SECTION("other parameters") {
    CHECK(refusal(folder.path()).empty());
    DatasetRecord other = kWanted;
    other.parameters = {{"world", "city"}, {"seed", "2"}, {"labels", "yes"}};
    CHECK_THAT(refusal(folder.path(), other),
               Catch::Contains("seed: 1 there, 2 asked for") &&
                   Catch::Contains("labels: none there, yes asked") &&
                   Catch::Contains("another --output"));
  }
  SECTION("a damaged record") {
    folder.write("simulation.json", GENERATE("{\"generator\": ", "", "[1, 2]", "{\"a\": \"x\"}"));
    CHECK_THAT(refusal(folder.path()), Catch::Contains("simulation.json: cannot be understood"));
  }
  SECTION("a place that cannot be written") {
    const fs::path below_file = folder.write("file", "") / "recordings";
    CHECK_THAT(refusal(below_file), Catch::Contains(below_file.string()));
  }
}

}  // namespace km
