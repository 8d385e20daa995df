#include <catch2/catch.hpp>

#include <thread>

#include "runtime/background_thread.hpp"

namespace km {
namespace {

int niceness() {
  return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()));
}

TEST_CASE("Background work lowers the priority of its own thread only", "[runtime]") {
  const int ordinary = niceness();
  int before = 0, during = 0;
  std::thread thread([&] {
    before = niceness();
    work_in_background();
    work_in_background();
    during = niceness();
  });
  thread.join();
  CHECK(before == ordinary);
  CHECK(during >= ordinary + (ordinary < 10 ? 1 : 0));  // 19 is the lowest there is
  CHECK(niceness() == ordinary);
}

}  // namespace
}  // namespace km
