#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "apps/team/robot_network.hpp"
#include "modules/link_emulation/link_emulator.hpp"
#include "runtime/guarded_thread.hpp"

namespace km {

/// Network namespaces for the robots of a team, and a thread that carries frames between them
/// according to a script. The time of the script begins with the construction.
class EmulatedLinks {
 public:
  /// Throws the exceptions of RobotNetwork and LinkEmulator. Construct it while no other thread of
  /// the program holds a lock, because it forks.
  explicit EmulatedLinks(LinkScript script);
  ~EmulatedLinks();
  EmulatedLinks(const EmulatedLinks&) = delete;
  EmulatedLinks& operator=(const EmulatedLinks&) = delete;

  [[nodiscard]] const RobotNetwork& network(std::size_t robot) const { return networks_[robot]; }

  /// The recording of a robot is at `recorded_s` [s since its start]. Thread-safe.
  void set_progress(std::size_t robot, double recorded_s);

  /// Ends the thread; frames in flight do not arrive. Returns the emulator with its counts. Throws
  /// std::runtime_error if frames could not be carried to the end.
  const LinkEmulator& finish();

 private:
  void carry();
  void take_frames(std::size_t robot, double now_s);
  void deliver(const SentFrame& delivery);
  void wait_for_frames(std::optional<double> due_in_s);
  void stop();

  std::mutex mutex_;  // guards emulator_ until the thread has ended
  LinkEmulator emulator_;
  std::vector<RobotNetwork> networks_;
  Descriptor wake_;
  double start_s_;
  std::atomic<bool> stopped_ = false;
  GuardedThread carrier_;
};

}  // namespace km
