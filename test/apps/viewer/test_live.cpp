#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>

#include "modules/view/view_channel_codec.hpp"
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

TEST_CASE("What robots of a domain tell is shown in the page", "[viewer]") {
  const int domain = random_domain();
  Process viewer({KM_BIN_DIR "/kimera_multi_viewer", "--domain", std::to_string(domain),
                  "--interface", "lo", "--port", "0"});
  const auto told = viewer.wait_for_prefix("Open http://127.0.0.1:");
  REQUIRE(told);
  PageListener page(std::stoi(told->text.substr(std::string("Open http://127.0.0.1:").size())),
                    "/updates");
  CHECK(page.hears(R"("live":true)"));

  const DdsParticipant robot(loopback(domain), {.robot = 7, .name = "alpha", .boot = 57});
  ViewWriter writer(robot.handle(), ViewChannel::kView, TeamPeer{7, 57});
  const auto deadline = Process::TimePoint::clock::now() + kPatience;
  while (writer.readers() == 0 && Process::TimePoint::clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  REQUIRE(writer.readers() == 1);
  ViewState state;
  state.name = "alpha";
  state.phase = "running";
  state.keyframes = 4711;
  writer.write(state);
  CHECK(page.hears(R"("keyframes":4711)"));
  viewer.kill(SIGINT);
  CHECK(viewer.wait() == 0);
}

}  // namespace
}  // namespace km
