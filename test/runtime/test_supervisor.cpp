#include <sys/wait.h>
#include <unistd.h>

#include "runtime/guarded_thread.hpp"
#include "runtime/supervisor.hpp"
#include "runtime/worker_node.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Notes when it is started and stopped; fails on demand.
class ToyNode final : public WorkerNode<bool> {
 public:
  ToyNode(std::string name, std::vector<std::string>& diary)
      : WorkerNode({.name = std::move(name), .queue = 4}), diary_(diary) {}
  ~ToyNode() override { stop(); }

  void give(bool fail) { post(fail); }
  bool holds_at_stop(int signal) const { return sigismember(&held_at_stop_, signal) == 1; }

 private:
  void handle(const bool& fail) override {
    if (fail) throw std::runtime_error("the reason");
  }
  void start_sources() override { diary_.push_back("start " + std::string(name())); }
  void conclude() override {
    diary_.push_back("stop " + std::string(name()));
    pthread_sigmask(SIG_BLOCK, nullptr, &held_at_stop_);
  }

  std::vector<std::string>& diary_;
  sigset_t held_at_stop_{};
};

struct Run {
  const CapturedLog log = {};
  std::vector<std::string> diary = {};
  SignalWatch signals = {};
  Supervisor supervisor{signals};
};

TEST_CASE("Nodes are started sources last and stopped sources first") {
  Run run;
  auto& [log, diary, signals, supervisor] = run;
  supervisor.emplace<ToyNode>("camera", diary);
  supervisor.emplace<ToyNode>("odometry", diary);
  int polls = 0;
  const RunResult result = supervisor.run([&] { return ++polls == 3; }, 0.001);
  CHECK_FALSE(result.failure.has_value());
  CHECK_FALSE(result.interrupted);
  CHECK(diary ==
        std::vector<std::string>{"start odometry", "start camera", "stop camera", "stop odometry"});
}

// A node with every kind of thread that a node may have; one of them fails.
class ThreadsNode final : public WorkerNode<Tick> {
 public:
  enum class Failing { kThread, kWorker };
  explicit ThreadsNode(Failing failing)
      : WorkerNode({.name = "threads", .tick_s = 1e-3}), failing_(failing) {}
  ~ThreadsNode() override { stop(); }
  std::exception_ptr error() const override {
    return first_of({WorkerNode::error(), receiver_.error()});
  }

 private:
  void fail_if(Failing thread) const {
    if (failing_ == thread) throw std::runtime_error("the reason");
  }
  void handle(const Tick& /*tick*/) override { fail_if(Failing::kWorker); }
  void start_sources() override {
    receiver_.start("receiver", [this] { fail_if(Failing::kThread); });
  }
  void stop_sources() noexcept override { receiver_.join(); }

  const Failing failing_;
  GuardedThread receiver_;
};

TEST_CASE("An exception in any thread of a node ends the run with the name of the node") {
  using Failing = ThreadsNode::Failing;
  const Failing failing = GENERATE(Failing::kThread, Failing::kWorker);
  Run run;
  run.supervisor.emplace<ThreadsNode>(failing);
  const RunResult result = run.supervisor.run([] { return false; }, 0.001);
  REQUIRE(result.failure.has_value());
  CHECK(result.failure->node == "threads");
  CHECK(result.failure->message == "the reason");
  CHECK_THAT(run.log.text(), Contains("threads failed: the reason"));
}

TEST_CASE("A node that fails while it finishes its work is still reported") {
  Run run;
  auto& [log, diary, signals, supervisor] = run;
  ToyNode& node = supervisor.emplace<ToyNode>("odometry", diary);
  const RunResult result = supervisor.run([&] {
    node.give(true);
    return true;
  });
  REQUIRE(result.failure.has_value());
}

// Hangs in its first step until it is released.
class HangingNode final : public WorkerNode<int> {
 public:
  explicit HangingNode(double step_limit_s = 0.5)
      : WorkerNode({.name = "hanging", .step_limit_s = step_limit_s}) {}
  ~HangingNode() override { stop(); }
  bool give() { return post(0); }
  void release() { released_.set_value(); }

 private:
  void handle(const int& /*input*/) override { released_.get_future().wait(); }

  std::promise<void> released_;
};

// Posts to a node without end. Its limit would make it the first to be blamed.
class FeedingNode final : public WorkerNode<int> {
 public:
  explicit FeedingNode(HangingNode& next)
      : WorkerNode({.name = "feeding", .step_limit_s = 0.25}), next_(next) {}
  ~FeedingNode() override { stop(); }

 private:
  void handle(const int& /*input*/) override {
    while (next_.give()) {
    }
  }
  void start_sources() override { post(0); }

  HangingNode& next_;
};

TEST_CASE("A node that hangs is abandoned and keeps no other from ending") {
  Run run;
  auto& [log, diary, signals, supervisor] = run;
  auto next = std::make_unique<HangingNode>();
  HangingNode& hanging = *next;
  supervisor.emplace<FeedingNode>(hanging);
  supervisor.add(std::move(next));
  supervisor.emplace<ToyNode>("last", diary);
  const RunResult result = supervisor.run([] { return false; }, 0.001);
  REQUIRE(result.failure.has_value());
  CHECK(result.failure->node == "hanging");
  CHECK(result.failure->hung);
  CHECK_THAT(result.failure->message, StartsWith("has not finished one step for"));
  CHECK(result.left_behind == std::vector<std::string>{"hanging"});
  CHECK(result.is_left_behind("hanging"));
  CHECK(diary.back() == "stop last");
  hanging.release();  // else the supervisor would wait for it
}

TEST_CASE("A node that hangs does not keep a signal from ending the run") {
  Run run;
  auto& [log, diary, signals, supervisor] = run;
  HangingNode& hanging = supervisor.emplace<HangingNode>();
  hanging.give();
  bool sent = false;
  const RunResult result = supervisor.run([&] {
    if (!std::exchange(sent, true)) kill(getpid(), SIGTERM);
    return false;
  });
  CHECK(result.interrupted);
  CHECK(result.left_behind == std::vector<std::string>{"hanging"});
  hanging.release();
}

TEST_CASE("Nodes are stopped during the run without waiting for them") {
  Run run;
  auto& [log, diary, signals, supervisor] = run;
  constexpr double kNoLimit_s = 1e3;  // a busy computer may not release it within half a second
  HangingNode& slow = supervisor.emplace<HangingNode>(kNoLimit_s);
  ToyNode& after = supervisor.emplace<ToyNode>("after", diary);
  supervisor.emplace<ToyNode>("other", diary);
  slow.give();
  bool asked = false;
  const RunResult result = supervisor.run(
      [&] {
        const bool ended = supervisor.have_stopped({&slow, &after});
        if (!std::exchange(asked, true)) {
          CHECK_FALSE(ended);
          CHECK(diary.back() == "start after");  // it is the turn of none after the slow one
          slow.release();
        }
        return ended;
      },
      0.001);
  CHECK_FALSE(result.failure.has_value());
  CHECK(diary ==
        std::vector<std::string>{"start other", "start after", "stop after", "stop other"});
}

TEST_CASE("The first signal ends the run in order") {
  const int signal = GENERATE(SIGINT, SIGTERM, SIGHUP);
  const auto before = std::signal(SIGHUP, SIG_DFL);  // the tests may run under nohup
  Run run;
  auto& [log, diary, signals, supervisor] = run;
  const ToyNode& camera = supervisor.emplace<ToyNode>("camera", diary);
  bool sent = false;
  const RunResult result = supervisor.run([&] {
    if (!std::exchange(sent, true)) kill(getpid(), signal);
    return false;
  });
  std::signal(SIGHUP, before);
  CHECK(result.interrupted);
  CHECK(diary.back() == "stop camera");
  CHECK(camera.holds_at_stop(signal));  // the thread that stops it may outlive the supervisor
}

TEST_CASE("A hang-up is not waited for where it was ignored before, as under nohup") {
  const auto before = std::signal(SIGHUP, SIG_IGN);
  {
    SignalWatch signals;
    kill(getpid(), SIGHUP);
    CHECK_FALSE(signals.wait(0.0).has_value());
  }
  std::signal(SIGHUP, before);
}

// A node that never ends, in a process of its own: only the second signal can help.
[[noreturn]] void run_stubborn_robot(int ready) {
  class Stubborn final : public Node {
   public:
    explicit Stubborn(int pipe) : pipe_(pipe) {}
    std::string_view name() const override { return "stubborn"; }
    void start() override {}
    void stop() noexcept override {
      const char stopping = 's';
      if (write(pipe_, &stopping, 1) != 1) _exit(9);
      while (true) pause();
    }
    std::exception_ptr error() const override { return nullptr; }

   private:
    int pipe_;
  };
  log::set_level(log::Level::kError);
  SignalWatch signals;
  Supervisor supervisor(signals);
  supervisor.emplace<Stubborn>(ready);
  const char running = 'r';
  bool reported = false;
  (void)supervisor.run([&] {
    if (!std::exchange(reported, true) && write(ready, &running, 1) != 1) _exit(9);
    return false;
  });
  _exit(0);
}

TEST_CASE("A second signal ends the process at once") {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const pid_t child = fork();
  if (child == 0) run_stubborn_robot(ends[1]);
  char reported = 0;
  REQUIRE(read(ends[0], &reported, 1) == 1);
  REQUIRE(reported == 'r');
  kill(child, SIGINT);
  REQUIRE(read(ends[0], &reported, 1) == 1);
  REQUIRE(reported == 's');
  kill(child, SIGHUP);  // a terminal that closes may send several
  kill(child, SIGINT);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGINT);
  close(ends[0]);
  close(ends[1]);
}

}  // namespace
}  // namespace km
