#pragma once

#include "modules/view/node/view_listener_node.hpp"
#include "test/modules/view/watcher.hpp"
#include "test/support/process.hpp"
#include "test/support/test.hpp"
#include "test/system/team_run.hpp"
#include "test/system/walk.hpp"

namespace km {

inline DdsConfig in_domain(int domain) {
  DdsConfig config;
  config.domain = domain;
  return config;
}

/// Viewer that listens on a thread of its own, until finish() and no more messages.
class Audience {
 public:
  explicit Audience(int domain)
      : listener_(in_domain(domain)), listening_thread_([this] { listen(); }) {}
  ~Audience() { finish(); }
  Audience(const Audience&) = delete;
  Audience& operator=(const Audience&) = delete;

  std::map<RobotId, Watcher>& finish() {
    is_over_ = true;
    if (listening_thread_.joinable()) listening_thread_.join();
    return robots_;
  }
  [[nodiscard]] std::uint64_t refused() const { return listener_.refused(); }

 private:
  void listen() {
    constexpr double kSilence_s = 0.5;
    for (;;) {
      const bool is_over = is_over_;
      const auto update = listener_.next(kSilence_s);
      if (update)
        robots_[update->robot].receive(update->content);
      else if (is_over)
        return;
    }
  }

  ViewListener listener_;
  std::map<RobotId, Watcher> robots_;
  std::atomic<bool> is_over_ = false;
  std::thread listening_thread_;
};

/// Command of a robot that walks, 20 keyframes a second. It ends by itself.
inline std::vector<std::string> robot_on(const Walk& walk, const Walk& other,
                                         const fs::path& folder, int domain,
                                         const std::string& rate = "20",
                                         std::uint32_t last = kLap) {
  const std::string name = robot_name(walk.robot);
  const fs::path graph = write_walk(walk, other, last, folder / (name + ".g2o"));
  return words_of(KM_BIN_DIR "/kimera_multi_robot --robot " + std::to_string(walk.robot) +
                  " --name " + name + " --graph " + graph.string() + " --rate " + rate +
                  " --output " + (folder / name).string() + " --domain " + std::to_string(domain));
}

/// Runs two robots that meet, watched from beginning to end.
inline void run_two_robots(const fs::path& folder, int domain) {
  const Walk a{0, 0}, b{1, 40};
  const auto watched = [&](const Walk& walk, const Walk& other) {
    auto command = robot_on(walk, other, folder, domain);
    command.emplace_back("--view");
    return command;
  };
  Process first(watched(a, b)), second(watched(b, a));
  CHECK(first.wait() == 0);
  CHECK(second.wait() == 0);
}

}  // namespace km
