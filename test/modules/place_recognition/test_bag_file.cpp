#include <catch2/catch.hpp>

#include <fstream>

#include "modules/place_recognition/bag_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

TEST_CASE("Bags of a file are those that were written", "[place_recognition]") {
  const TemporaryFolder folder;
  const std::vector<BagOfWords> bags = {{{0, 1}, {7, 3}}, {}, {{4294967295U, 65536}}};
  CHECK(bags_text(bags) == "0:1 7:3\n\n4294967295:65536\n");
  std::ofstream(folder.path() / "bags.txt") << bags_text(bags);
  CHECK(read_bags(folder.path() / "bags.txt") == bags);
}

TEST_CASE("A line that is no bag is refused with its number", "[place_recognition]") {
  const TemporaryFolder folder;
  const std::string line =
      GENERATE("7:0", "7:1 7:1", "9:1 7:1", "7", "7:1,8:1", "-7:1", "7:1 ", "4294967296:1");
  CAPTURE(line);
  std::ofstream(folder.path() / "bags.txt") << "1:1\n" << line << '\n';
  CHECK_THROWS_WITH(read_bags(folder.path() / "bags.txt"),
                    Catch::Contains("bags.txt, line 2: no bag of words"));
  CHECK_THROWS_WITH(read_bags(folder.path() / "none.txt"), Catch::Contains("cannot be read"));
}

}  // namespace
}  // namespace km
