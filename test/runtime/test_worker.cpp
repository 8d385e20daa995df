#include <pthread.h>

#include <array>
#include <catch2/catch.hpp>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {
namespace {

TEST_CASE("A worker handles everything posted, in order, before stop returns", "[worker]") {
  std::vector<int> handled;
  Worker<int> worker(2, Overflow::kBlock, [&](int i) { handled.push_back(i); });
  worker.start();
  for (int i = 0; i < 100; ++i) CHECK(worker.post(i));
  worker.stop();
  REQUIRE(handled.size() == 100);
  for (int i = 0; i < 100; ++i) CHECK(handled[static_cast<std::size_t>(i)] == i);
  CHECK_FALSE(worker.post(100));
  CHECK(worker.error() == nullptr);
}

TEST_CASE("A worker that throws keeps the exception and lets nobody wait for it", "[worker]") {
  Worker<int> worker(1, Overflow::kBlock, [](int) { throw std::runtime_error("no"); });
  worker.start();
  while (worker.post(0)) {
  }
  worker.stop();
  REQUIRE(worker.error() != nullptr);
  CHECK_THROWS_WITH(std::rethrow_exception(worker.error()), "no");
}

TEST_CASE("The thread of a worker carries its name", "[worker]") {
  std::array<char, 16> name{};
  Worker<int> worker(
      1, Overflow::kBlock,
      [&](int) { pthread_getname_np(pthread_self(), name.data(), name.size()); },
      "a name far too long for Linux");
  worker.start();
  worker.post(0);
  worker.stop();
  CHECK(std::string(name.data()) == "a name far too ");
}

TEST_CASE("A worker that never started stops", "[worker]") {
  Worker<int> worker(1, Overflow::kBlock, [](int) {});
  worker.post(0);
  worker.stop();
  CHECK(worker.error() == nullptr);
}

TEST_CASE("A topic hands one shared message to every subscriber, in order", "[topic]") {
  Topic<int> topic;
  std::vector<std::pair<int, const int*>> heard;
  topic.subscribe([&](const auto& message) { heard.emplace_back(1, message.get()); });
  topic.subscribe([&](const auto& message) { heard.emplace_back(2, message.get()); });
  topic.publish(7);
  REQUIRE(heard.size() == 2);
  CHECK(heard[0].first == 1);
  CHECK(heard[1].first == 2);
  CHECK(heard[0].second == heard[1].second);
}

// A node cannot write what it is to read, nor take what comes from peers for what goes to them.
static_assert(!std::is_convertible_v<In<int>, Out<int>>);
static_assert(!std::is_convertible_v<Out<int>, In<int>>);

TEST_CASE("What is published through one handle of a topic is heard through another", "[topic]") {
  Topic<int> topic;
  const In<int> in = topic;
  const Out<int> out = topic;
  std::vector<int> heard;
  in.subscribe([&](const auto& message) { heard.push_back(*message); });
  out.publish(7);
  out.publish(std::make_shared<const int>(8));
  CHECK(heard == std::vector<int>{7, 8});
}

}  // namespace
}  // namespace km
