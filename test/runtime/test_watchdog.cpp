#include <sched.h>

#include "runtime/clock.hpp"
#include "runtime/thread.hpp"
#include "runtime/watchdog.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kTick_s = 0.5;

// Its steps are made by the test.
class WatchedNode final : public Node {
 public:
  std::string_view name() const override { return "toy"; }
  void start() override {}
  void stop() noexcept override {}
  std::exception_ptr error() const override { return nullptr; }
  std::vector<Heartbeat*> heartbeats() override { return {&heartbeat}; }
  double step_limit_s() const override { return 20.0; }

  bool freed = false;
  Heartbeat heartbeat{[this] { freed = true; }};
};

struct Bench {
  CapturedLog log;
  WatchedNode node;
  Watchdog watchdog{{&node}, 1.0};

  void pass(double s) {
    for (double t = 0.0; t < s; t += kTick_s) watchdog.tick(kTick_s);
  }
};

TEST_CASE("A step that does not end is named within 5 s and given up after its limit") {
  Bench bench;
  const Heartbeat::Step step(bench.node.heartbeat);
  bench.pass(3.0);
  CHECK(bench.log.text().empty());
  bench.pass(2.0);
  CHECK_THAT(bench.log.text(), Contains("warn supervisor: toy has not finished one step for 4 s"));
  bench.pass(14.0);
  CHECK_FALSE(bench.watchdog.given_up().has_value());
  CHECK_FALSE(bench.node.freed);
  bench.pass(2.0);
  REQUIRE(bench.watchdog.given_up().has_value());
  CHECK(bench.watchdog.given_up()->node == "toy");
  CHECK(bench.watchdog.given_up()->why == "has not finished one step for 20 s");
  CHECK(bench.watchdog.has_given_up(bench.node));
  CHECK(bench.node.freed);
  CHECK(bench.log.lines().size() == 1);  // named once
}

TEST_CASE("A long step that ends is no fault, and many steps are none") {
  Bench bench;
  for (int i = 0; i < 10; ++i) {
    const Heartbeat::Step step(bench.node.heartbeat);
    bench.pass(15.0);
  }
  bench.pass(100.0);  // nothing to do
  CHECK_FALSE(bench.watchdog.given_up().has_value());
}

TEST_CASE("A step to which a busy machine gives no processor is not given up") {
  WatchedNode node;
  Watchdog watchdog({&node}, 0.03);  // a limit of 0.6 s
  cpu_set_t allowed, one;
  sched_getaffinity(0, sizeof(allowed), &allowed);
  CPU_ZERO(&one);
  for (std::size_t cpu = 0; CPU_COUNT(&one) == 0; ++cpu)
    if (CPU_ISSET(cpu, &allowed)) CPU_SET(cpu, &one);
  std::atomic<bool> ends = false, has_begun = false;
  const auto be_busy = [&] {
    sched_setaffinity(0, sizeof(one), &one);
    while (!ends) has_begun = true;
  };
  std::jthread busy(be_busy);
  while (!has_begun) std::this_thread::yield();
  std::jthread late([&] {
    work_in_background();
    const Heartbeat::Step step(node.heartbeat);
    be_busy();
  });
  while (!node.heartbeat.in_step()) std::this_thread::yield();
  for (double last_s = steady_now_s(), end_s = last_s + 1.5; last_s < end_s;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const double now_s = steady_now_s();
    watchdog.tick(now_s - std::exchange(last_s, now_s));
  }
  CHECK_FALSE(watchdog.given_up().has_value());
  ends = true;
}

TEST_CASE("A node that waits for another is not blamed until it continues") {
  Bench bench;
  const Heartbeat::Step step(bench.node.heartbeat);
  {
    const Heartbeat::Waiting waiting;
    bench.pass(100.0);
  }
  bench.pass(19.0);
  CHECK_FALSE(bench.watchdog.given_up().has_value());
  bench.pass(3.0);
  CHECK(bench.watchdog.given_up().has_value());
}

TEST_CASE("A node that is to end and makes no steps is given up") {
  Bench bench;
  bench.pass(100.0);
  bench.watchdog.expect_end(bench.node);
  for (int i = 0; i < 5; ++i) {
    bench.pass(15.0);
    const Heartbeat::Step step(bench.node.heartbeat);  // it processes its remaining inputs
  }
  CHECK_FALSE(bench.watchdog.given_up().has_value());
  bench.pass(22.0);
  REQUIRE(bench.watchdog.given_up().has_value());
  CHECK(bench.watchdog.given_up()->why == "has not ended for 20 s");
}

TEST_CASE("A node that has ended is not blamed any more") {
  Bench bench;
  bench.watchdog.expect_end(bench.node);
  bench.watchdog.has_ended(bench.node);
  bench.pass(100.0);
  CHECK_FALSE(bench.watchdog.given_up().has_value());
}

TEST_CASE("Patience multiplies the limits") {
  const CapturedLog log;
  WatchedNode node;
  Watchdog watchdog({&node}, 2.0);
  const Heartbeat::Step step(node.heartbeat);
  for (double t = 0.0; t < 39.0; t += kTick_s) watchdog.tick(kTick_s);
  CHECK_FALSE(watchdog.given_up().has_value());
  for (double t = 0.0; t < 2.0; t += kTick_s) watchdog.tick(kTick_s);
  CHECK(watchdog.given_up().has_value());
}

}  // namespace
}  // namespace km
