#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>
#include <vector>

#include "modules/core/io/descriptor.hpp"
#include "modules/link_emulation/link_emulator.hpp"
#include "runtime/guarded_thread.hpp"

namespace km {

/// A network of a robot on this host: a network namespace with loopback and one Ethernet interface,
/// eth0, whose frames this program reads and writes. It is made as root, or in a user namespace.
/// Only descriptors keep it. It therefore vanishes when this object and the programs in the network
/// have ended, even by a crash.
class RobotNetwork {
 public:
  /// The network of robot `robot`, with ethernet_address() and 10.77.x.y/16, counted from
  /// 10.77.0.1. Throws std::runtime_error that names the operation that the system refuses, and a
  /// remedy.
  explicit RobotNetwork(std::size_t robot);

  /// Each read returns a frame that the robot sent; each write delivers a frame to it. Does not
  /// block.
  [[nodiscard]] int frames() const { return tap_.get(); }

  /// Moves the calling process, which must have one thread, into the network. Async-signal-safe.
  /// False, with errno, if it is not allowed.
  [[nodiscard]] bool enter() const;

 private:
  Descriptor tap_;
  Descriptor user_;  // user namespace; none if root made the network
  Descriptor network_;
};

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
