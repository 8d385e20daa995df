#include <catch2/catch.hpp>
#include <utility>
#include <vector>

#include "modules/view/view_incumbents.hpp"

namespace km {
namespace {

constexpr std::uint64_t kFirst = 50, kSecond = 60;

// Updates that counted, by boot id and keyframe.
struct Page {
  ViewIncumbents incumbents;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> shown;

  auto taker() {
    return [this](const ViewUpdate& update) {
      const auto* const keyframes = std::get_if<ViewKeyframes>(&update.content);
      if (keyframes != nullptr) shown.emplace_back(update.boot, keyframes->first);
    };
  }
  void serve(double now_s) { incumbents.serve(now_s, taker()); }
  void send(std::uint64_t boot, ViewContent content, double now_s) {
    incumbents.add({3, boot, 0, std::move(content)}, now_s, taker());
    serve(now_s);
  }
  void send(std::uint64_t boot, std::uint32_t keyframe, double now_s) {
    send(boot, ViewContent(ViewKeyframes{.first = keyframe}), now_s);
  }
};

using Shown = std::vector<std::pair<std::uint64_t, std::uint32_t>>;

}  // namespace

TEST_CASE("A resumed robot is shown from its beginning once the former process is silent",
          "[view]") {
  Page page;
  page.send(kFirst, 0, 0.0);
  for (std::uint32_t k = 0; k < 4; ++k) page.send(kSecond, k, 1.0 + k);
  CHECK(page.shown == Shown{{kFirst, 0}});
  page.serve(4.9);
  CHECK(page.shown.size() == 1);
  page.serve(5.0);
  CHECK(page.shown == Shown{{kFirst, 0}, {kSecond, 0}, {kSecond, 1}, {kSecond, 2}, {kSecond, 3}});
  page.send(kSecond, 4, 5.5);
  CHECK(page.shown.size() == 6);
  page.send(kFirst, 9, 6.0);  // Its last update, which is late.
  CHECK(page.shown.size() == 6);
}

TEST_CASE("After a robot has left another process with its id counts at once", "[view]") {
  Page page;
  page.send(kFirst, 0, 0.0);
  page.send(kFirst, ViewContent(RobotSample{.name = "alice", .phase = "leaving"}), 1.0);
  page.send(kSecond, 0, 1.1);
  CHECK(page.shown == Shown{{kFirst, 0}, {kSecond, 0}});
}

TEST_CASE("The number of waiting updates is bounded", "[view]") {
  Page page;
  for (std::uint32_t k = 0; k < ViewIncumbents::kMostWaiting + 100; ++k) {
    page.send(kFirst, k, 1e-3 * k);
    page.send(kSecond, k, 1e-3 * k);
  }
  CHECK(page.incumbents.dropped() == 100);
}

}  // namespace km
