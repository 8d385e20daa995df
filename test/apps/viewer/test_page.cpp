#include "modules/view/node/view_channel_codec.hpp"
#include "runtime/dds/participant.hpp"
#include "test/apps/viewer/page_listener.hpp"
#include "test/apps/viewer/page_programs.hpp"
#include "test/apps/viewer/small_run.hpp"
#include "test/support/command.hpp"
#include "test/support/demo_world.hpp"
#include "test/support/process.hpp"
#include "test/support/test.hpp"
#include "test/system/team_run.hpp"

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

TEST_CASE("The page has the content of the files of a run, at any time of the run", "[slow]") {
  check_page_of_run("page_of_run.mjs");
}

TEST_CASE("The page opens and turns while another host attacks the viewer", "[slow]") {
  check_page_of_run("page_under_attack.mjs");
}

TEST_CASE("The page follows a team that runs, shows its past, and knows how it ended",
          "[demo_world]") {
  std::string why = missing_page_program();
  if (!fs::exists(KM_BIN_DIR "/kimera_multi_simulate")) why = "no simulator (Embree)";
  if (!why.empty()) {
    std::cout << "SKIPPED: " << why << '\n';
    return;
  }
  const TemporaryFolder folder;
  if (fs::exists(kDemoWorld))  // otherwise the demo renders it
    fs::copy(kDemoWorld, folder.path() / "world_short", fs::copy_options::recursive);
  const CommandResult result =
      run_command("node test/apps/viewer/page_of_team.mjs " KM_BIN_DIR " " +
                  folder.path().string() + " '' --short --rate 0.3");
  INFO(result.output);
  CHECK(result.exit_code == 0);
}

TEST_CASE("The page's model keeps all messages by their time") {
  if (run_command("node --version").exit_code != 0) {
    std::cout << "SKIPPED: no node (apt-get install nodejs)\n";
    return;
  }
  const CommandResult result = run_command("node test/apps/viewer/model_test.mjs");
  INFO(result.output);
  CHECK(result.exit_code == 0);
}

TEST_CASE("The viewer refuses unusable input") {
  const TemporaryFolder empty;
  const auto result = run_command(kViewer + ' ' + empty.path().string());
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Contains("no results in it"));
  CHECK(run_command(kViewer + " --rate 0 x").exit_code == 2);
  CHECK_THAT(run_command(kViewer).output, Contains("--domain of a team that runs"));
  CHECK(run_command(kViewer + " --domain 7 x").exit_code == 2);
  CHECK(run_command(kViewer + " --help").exit_code == 0);
  CHECK(run_command(kViewer + " --domain 7 --interface lo --listen 203.0.113.7").exit_code == 1);
}

DdsConfig loopback(int domain) {
  DdsConfig config{.domain = domain, .interface = "lo", .peers = {}};
  return config;
}

TEST_CASE("Messages of the robots of a domain are shown in the page") {
  const int domain = random_domain();
  Process viewer({"sh", "-c",
                  "exec " KM_BIN_DIR "/kimera_multi_viewer --interface lo --port 0 --domain " +
                      std::to_string(domain) + " 2>&1"});
  CHECK(viewer.wait_until([](const std::string& line) {
    return line.find("shows robots that run with --view") != std::string::npos;
  }));
  const auto address = viewer.wait_for_prefix("Open http://127.0.0.1:");
  REQUIRE(address);
  PageListener page(std::stoi(address->text.substr(std::string("Open http://127.0.0.1:").size())),
                    "/updates?page=a");
  CHECK(page.receives(R"("source":"live")"));

  const DdsParticipant robot(loopback(domain), {.robot = 7, .name = "alpha", .boot = 57});
  ViewWriter writer(robot.handle(), ViewChannel::kView, TeamPeer{7, 57});
  const auto deadline = Process::TimePoint::clock::now() + kPatience;
  while (writer.readers() == 0 && Process::TimePoint::clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  REQUIRE(writer.readers() == 1);
  RobotSample state{.name = "alpha", .phase = "running", .keyframes = 4711};
  writer.write(state);
  CHECK(page.receives(R"("keyframes":4711)"));
  writer.write(ViewPose{5'000'000'000, SE3::Identity()});
  CHECK(page.receives(R"("kind":"pose")"));
  viewer.kill(SIGINT);
  CHECK(viewer.wait() == 0);
}

}  // namespace
}  // namespace km
