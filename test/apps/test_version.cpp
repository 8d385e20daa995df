#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "test/support/command.hpp"

namespace km {

TEST_CASE("Every program says its version, its commit and what it was built with", "[version]") {
  int programs = 0;
  for (const auto& file : std::filesystem::directory_iterator(KM_BIN_DIR)) {
    const std::string name = file.path().filename().string();
    if (!name.starts_with("kimera_multi_")) continue;
    ++programs;
    CAPTURE(name);
    const CommandResult result = run_command(file.path().string() + " --version");
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.output, Catch::StartsWith(name + " ") && Catch::Contains("\ncommit ") &&
                                  Catch::Contains("\nbuilt with ") && Catch::Contains("Eigen 3.") &&
                                  Catch::Contains("Cyclone DDS ") && Catch::Contains("OpenCV 4.") &&
                                  Catch::Contains("Ceres 2."));
  }
  CHECK(programs > 0);
}

}  // namespace km
