#include <type_traits>

#include "runtime/bounded_queue.hpp"
#include "runtime/latest.hpp"
#include "runtime/thread.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker_node.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("A worker handles everything posted, in order, before stop returns") {
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

// A node with a clock, whose first step waits until it is released.
class ToyWorkerNode final : public WorkerNode<Tick> {
 public:
  ToyWorkerNode(std::vector<std::string>& diary, bool fails, std::size_t queue = 1)
      : WorkerNode({.name = "toy", .queue = queue, .tick_s = 1e-4, .step_limit_s = 7.0}),
        diary_(diary),
        fails_(fails) {}
  ~ToyWorkerNode() override { stop(); }
  void release() { released_.set_value(); }
  [[nodiscard]] int handled() const { return handled_; }
  using WorkerNode::load;

 private:
  void handle(const Tick& /*tick*/) override {
    if (handled_++ == 0) released_.get_future().wait();
    if (fails_) throw std::runtime_error("no");
  }
  void start_sources() override { diary_.emplace_back("sources"); }
  void stop_sources() noexcept override { diary_.emplace_back("no sources"); }
  void conclude() override { diary_.emplace_back("end"); }

  std::vector<std::string>& diary_;
  const bool fails_;
  std::promise<void> released_;
  std::atomic<int> handled_ = 0;
};

TEST_CASE("A node ends its sources, then its clock and its worker, and concludes once") {
  const bool fails = GENERATE(false, true);
  std::vector<std::string> diary;
  {
    ToyWorkerNode node(diary, fails);
    CHECK(node.name() == "toy");
    CHECK(node.step_limit_s() == 7.0);
    node.start();
    while (node.handled() == 0 || node.load().size == 0) std::this_thread::yield();
    const auto stopped = std::async(std::launch::async, [&] { node.stop(); });
    CHECK(stopped.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout);
    node.release();
    stopped.wait();
    CHECK((node.error() != nullptr) == fails);
    CHECK((fails || node.handled() >= 2));  // the queued tick is handled
    CHECK(node.heartbeats().size() == 1);
    CHECK(node.timing().count() == static_cast<std::uint64_t>(node.handled()));
  }
  std::vector<std::string> expected{"sources", "no sources", "end", "no sources"};
  if (fails) std::erase(expected, "end");
  CHECK(diary == expected);
}

TEST_CASE("During a long step, one tick waits and leaves the queue to others") {
  std::vector<std::string> diary;
  ToyWorkerNode node(diary, false, 1000);
  node.start();
  while (node.handled() == 0 || node.load().size == 0) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // 200 periods
  CHECK(node.load().size == 1);
  node.release();
  while (node.handled() < 5) std::this_thread::yield();  // the clock continues
}

TEST_CASE("A worker that throws keeps the exception and releases the threads that wait for it") {
  Worker<int> worker(1, Overflow::kBlock, [](int) { throw std::runtime_error("no"); });
  worker.start();
  while (worker.post(0)) {
  }
  worker.stop();
  REQUIRE(worker.error() != nullptr);
  CHECK_THROWS_WITH(std::rethrow_exception(worker.error()), "no");
}

// A node can neither write its inputs nor confuse the channels from peers and to peers.
static_assert(!std::is_convertible_v<In<int>, Out<int>>);
static_assert(!std::is_convertible_v<Out<int>, In<int>>);

TEST_CASE("A full queue that drops keeps the newest and counts the others") {
  BoundedQueue<int> queue(2, Overflow::kDropOldest);
  for (int i = 0; i < 5; ++i) queue.push(i);
  CHECK(queue.load().size == 2);
  CHECK(queue.load().dropped == 3);
  CHECK(queue.pop() == 3);
  CHECK(queue.pop() == 4);
  CHECK(queue.load().size == 0);
}

TEST_CASE("A taker sees increasingly newer values while others are put, and the last one once") {
  constexpr int kLast = 10000;
  Latest<int> latest;
  std::thread putter([&] {
    for (int i = 1; i <= kLast; ++i) latest.put(std::make_shared<const int>(i));
  });
  int seen = 0;
  bool ascending = true;
  while (seen < kLast)
    if (const auto value = latest.take()) {
      ascending = ascending && *value > seen;
      seen = *value;
    }
  putter.join();
  CHECK(ascending);
  CHECK(latest.take() == nullptr);
  latest.put(std::make_shared<const int>(1));
  latest.close();
  latest.put(std::make_shared<const int>(2));
  CHECK(*latest.take() == 1);
}

int niceness() {
  return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()));
}

TEST_CASE("Urgent work lowers the priority of a thread in the background, never raises it") {
  const bool is_urgent = GENERATE(true, false), is_low_already = GENERATE(true, false);
  CAPTURE(is_urgent, is_low_already);
  constexpr int kLowest = 19;
  const int ordinary = niceness();
  has_urgent_work = is_urgent;
  int before = 0, during = 0;
  std::thread thread([&] {
    if (is_low_already) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kLowest);
    before = niceness();
    work_in_background();
    work_in_background();
    during = niceness();
  });
  thread.join();
  has_urgent_work = true;
  CHECK(before == (is_low_already ? kLowest : ordinary));
  CHECK(during == (is_urgent ? std::max(before, 10) : before));
  CHECK(niceness() == ordinary);
}

}  // namespace
}  // namespace km
