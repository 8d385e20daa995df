#include <catch2/catch.hpp>
#include <sstream>
#include <string>

#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

constexpr const char* kCommitPattern = "(unknown|[0-9a-f]{10,40}(-dirty)?)";

}  // namespace

TEST_CASE("Every program prints its version, its commit and its build settings", "[version]") {
  std::istringstream programs(KM_PROGRAMS);  // all of this build
  int count = 0;
  for (std::string name; programs >> name; ++count) {
    CAPTURE(name);
    const CommandResult result = run_command(KM_BIN_DIR "/" + name + " --version");
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.output, Catch::Matches(name + " " KM_VERSION "\ncommit " + kCommitPattern +
                                             "\nbuilt with [A-Za-z]+ [0-9.]+, [A-Za-z]+, "
                                             "Cyclone DDS [0-9.]+, Eigen [0-9.]+, "
                                             "OpenCV [0-9.]+, Ceres [0-9.]+\n"));
  }
  CHECK(count >= 9);  // without simulator and viewer
}

namespace {

// Sources in a folder, and the commit that the build finds for them.
struct Sources {
  TemporaryFolder folder;

  Sources() { folder.write("tree/CMakeLists.txt", "one"); }
  CommandResult git(const std::string& arguments) const {
    return run_command("git -C " + folder.path().string() +
                       "/tree -c user.name=a -c user.email=a@b " + arguments);
  }
  void commit() const {
    REQUIRE(git("init -q").exit_code == 0);
    REQUIRE(git("add CMakeLists.txt").exit_code == 0);
    REQUIRE(git("commit -q -m one").exit_code == 0);
  }
  // As found in the subfolder `tree`.
  std::string found(const std::string& tree = "tree") const {
    const std::string root = folder.path().string() + '/';
    // The folder for temporary files may be below a repository.
    const CommandResult result =
        run_command("GIT_CEILING_DIRECTORIES=" + root + " cmake -DSOURCE=" + root + tree +
                    " -DOUTPUT=" + root + "commit.hpp -P apps/write_commit.cmake");
    CAPTURE(result.output);
    REQUIRE(result.exit_code == 0);
    const std::string header = folder.read("commit.hpp");
    const std::size_t begin = header.find('"') + 1;
    return header.substr(begin, header.find('"', begin) - begin);
  }
};

}  // namespace

TEST_CASE("The build knows the commit of its sources, and whether they differ", "[version]") {
  const Sources sources;
  CHECK(sources.found() == "unknown");
  if (run_command("git --version").exit_code != 0) {
    WARN("SKIPPED: no git");
    return;
  }
  sources.commit();
  const std::string commit = sources.found();
  CHECK_THAT(commit, Catch::Matches("[0-9a-f]{10,40}"));
  sources.folder.write("tree/build/x.o", "not tracked");
  CHECK(sources.found() == commit);
  sources.folder.write("tree/CMakeLists.txt", "two");
  CHECK(sources.found() == commit + "-dirty");
  // A release below the repository of another project does not take its commit.
  sources.folder.write("tree/release/CMakeLists.txt", "one");
  CHECK(sources.found("tree/release") == "unknown");
}

TEST_CASE("The header of an unchanged commit is not written again", "[version]") {
  const Sources sources;
  static_cast<void>(sources.found());
  const auto header = sources.folder.path() / "commit.hpp";
  const auto written = std::filesystem::file_time_type{};
  std::filesystem::last_write_time(header, written);
  static_cast<void>(sources.found());
  CHECK(std::filesystem::last_write_time(header) == written);
}

}  // namespace km
