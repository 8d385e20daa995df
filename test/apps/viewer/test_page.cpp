#include <catch2/catch.hpp>

#include <filesystem>
#include <iostream>

#include "test/apps/viewer/page_programs.hpp"
#include "test/apps/viewer/small_run.hpp"
#include "test/support/command.hpp"
#include "test/support/demo_world.hpp"

namespace km {
namespace {

const std::string kViewer = KM_BIN_DIR "/kimera_multi_viewer";

void check_page_of_run(const std::string& script) {
  if (const std::string why = missing_page_program(); !why.empty()) {
    std::cout << "SKIPPED: " << why << '\n';
    return;
  }
  const SmallRun run;
  const CommandResult result = run_command("node test/apps/viewer/" + script + ' ' + kViewer + ' ' +
                                           run.folder.path().string());
  INFO(result.output);
  CHECK(result.exit_code == 0);
}

TEST_CASE("The page has the content of the files of a run, at any time of the run",
          "[page][slow]") {
  check_page_of_run("page_of_run.mjs");
}

TEST_CASE("The page opens and turns while another host attacks the viewer", "[page][slow]") {
  check_page_of_run("page_under_attack.mjs");
}

TEST_CASE("The page follows a team that runs, shows its past, and knows how it ended",
          "[page][demo_world]") {
  std::string why = missing_page_program();
  if (!std::filesystem::exists(KM_BIN_DIR "/kimera_multi_simulate")) why = "no simulator (Embree)";
  if (!why.empty()) {
    std::cout << "SKIPPED: " << why << '\n';
    return;
  }
  const TemporaryFolder folder;
  if (std::filesystem::exists(kDemoWorld))  // otherwise the demo renders it
    std::filesystem::copy(kDemoWorld, folder.path() / "world_short",
                          std::filesystem::copy_options::recursive);
  const CommandResult result =
      run_command("node test/apps/viewer/page_of_team.mjs " KM_BIN_DIR " " +
                  folder.path().string() + " '' --short --rate 0.3");
  INFO(result.output);
  CHECK(result.exit_code == 0);
}

TEST_CASE("The page's model keeps all messages by their time", "[page]") {
  if (run_command("node --version").exit_code != 0) {
    std::cout << "SKIPPED: no node (apt-get install nodejs)\n";
    return;
  }
  const CommandResult result = run_command("node test/apps/viewer/model_test.mjs");
  INFO(result.output);
  CHECK(result.exit_code == 0);
}

TEST_CASE("The viewer refuses unusable input", "[viewer]") {
  const TemporaryFolder empty;
  const auto result = run_command(kViewer + ' ' + empty.path().string());
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Catch::Contains("no results in it"));
  CHECK(run_command(kViewer + " --rate 0 x").exit_code == 2);
  CHECK_THAT(run_command(kViewer).output, Catch::Contains("--domain of a team that runs"));
  CHECK(run_command(kViewer + " --domain 7 x").exit_code == 2);
  CHECK(run_command(kViewer + " --help").exit_code == 0);
  CHECK(run_command(kViewer + " --domain 7 --interface lo --listen 203.0.113.7").exit_code == 1);
}

}  // namespace
}  // namespace km
