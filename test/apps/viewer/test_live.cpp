#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>

#include "modules/view/node/view_channel_codec.hpp"
#include "runtime/dds/participant.hpp"
#include "test/apps/viewer/page_listener.hpp"
#include "test/support/process.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

DdsConfig loopback(int domain) {
  DdsConfig config;
  config.domain = domain;
  config.interface = "lo";
  return config;
}

TEST_CASE("Messages of the robots of a domain are shown in the page", "[viewer]") {
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
                    "/updates");
  CHECK(page.receives(R"("source":"live")"));

  const DdsParticipant robot(loopback(domain), {.robot = 7, .name = "alpha", .boot = 57});
  ViewWriter writer(robot.handle(), ViewChannel::kView, TeamPeer{7, 57});
  const auto deadline = Process::TimePoint::clock::now() + kPatience;
  while (writer.readers() == 0 && Process::TimePoint::clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  REQUIRE(writer.readers() == 1);
  RobotSample state;
  state.name = "alpha";
  state.phase = "running";
  state.keyframes = 4711;
  writer.write(state);
  CHECK(page.receives(R"("keyframes":4711)"));
  writer.write(ViewPose{5'000'000'000, SE3::Identity()});
  CHECK(page.receives(R"("kind":"pose")"));
  viewer.kill(SIGINT);
  CHECK(viewer.wait() == 0);
}

}  // namespace
}  // namespace km
