#include <catch2/catch.hpp>
#include <stdexcept>

#include "apps/lab/simulate/frame_workers.hpp"

namespace km {

TEST_CASE("Every frame is worked on once, whatever the number of threads", "[simulate]") {
  const int threads = GENERATE(1, 2, 5);
  std::vector<std::atomic<int>> calls(1000);
  FrameWorkers workers(threads, calls.size(), [&](std::size_t i) { ++calls[i]; });
  workers.join();
  CHECK(workers.is_finished());
  for (const auto& count : calls) REQUIRE(count == 1);
}

TEST_CASE("The first error ends the workers and reaches the caller", "[simulate]") {
  std::atomic<int> after = 0;
  FrameWorkers workers(2, 1'000'000, [&](std::size_t i) {
    if (i == 10) throw std::runtime_error("frame 10");
    if (i > 10) ++after;
  });
  CHECK_THROWS_WITH(workers.join(), "frame 10");
  CHECK(after < 1'000'000 - 11);
}

TEST_CASE("Stopped workers finish what they have begun", "[simulate]") {
  std::atomic<int> begun = 0, ended = 0;
  std::atomic<bool> stopped = false;
  FrameWorkers workers(2, 1000, [&](std::size_t) {
    ++begun;
    while (!stopped) std::this_thread::yield();
    ++ended;
  });
  while (begun < 2) std::this_thread::yield();
  workers.stop();
  stopped = true;
  workers.join();
  CHECK(begun == 2);
  CHECK(ended == 2);
}

}  // namespace km
