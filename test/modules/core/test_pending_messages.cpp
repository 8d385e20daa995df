#include "modules/core/data/pending_messages.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Pending = PendingMessages<int, std::string>;

// Served messages of the known senders, in order.
std::vector<std::string> serve_all(Pending& pending, const std::vector<int>& are_known) {
  std::vector<std::string> served;
  const auto take = [&](int from, const std::string& message, double /*waited_s*/) {
    if (std::ranges::count(are_known, from) == 0) return false;
    served.push_back(message);
    return true;
  };
  while (pending.serve(0.0, take) > 0) {
  }
  return served;
}

TEST_CASE("Waiting messages are served oldest first and in turn between the senders") {
  Pending pending;
  for (const char* message : {"a1", "a2", "a3"}) REQUIRE(pending.push(1, message, 1, 0.0));
  REQUIRE(pending.push(2, "b1", 1, 0.0));
  REQUIRE(pending.push(3, "c1", 1, 0.0));
  CHECK(serve_all(pending, {1, 3}) == std::vector<std::string>{"a1", "c1", "a2", "a3"});
  CHECK(pending.contains(2));
  CHECK_FALSE(pending.contains(1));
  CHECK(serve_all(pending, {2}) == std::vector<std::string>{"b1"});
  CHECK(pending.empty());
}

TEST_CASE("A full queue refuses messages and removed messages make room") {
  Pending pending({.bytes = 15, .bytes_of_one = 10});
  CHECK(pending.push(1, "a1", 6, 0.0));
  CHECK_FALSE(pending.push(1, "a2", 6, 0.0));
  CHECK(pending.push(1, "a3", 4, 0.0));
  CHECK_FALSE(pending.push(2, "b1", 6, 0.0));  // bound on all queues together
  CHECK_FALSE(pending.contains(2));
  CHECK(pending.push(2, "b2", 5, 0.0));
  CHECK(serve_all(pending, {1}) == std::vector<std::string>{"a1", "a3"});
  CHECK(pending.push(1, "a4", 10, 0.0));
  CHECK(serve_all(pending, {1, 2}) == std::vector<std::string>{"a4", "b2"});
}

TEST_CASE("The waiting time of a message is known") {
  Pending pending;
  REQUIRE(pending.push(1, "a", 1, 10.0));
  double waited_s = 0.0;
  CHECK(pending.serve(12.5, [&](int, const std::string&, double s) {
    waited_s = s;
    return false;
  }) == 0);
  CHECK(waited_s == 2.5);
  CHECK(pending.contains(1));
}

}  // namespace
}  // namespace km
