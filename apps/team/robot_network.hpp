#pragma once

#include <cstddef>
#include <string>

namespace km {

/// A file descriptor, closed with this.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept;
  Descriptor& operator=(Descriptor&& other) noexcept;

  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

/// A network of a robot's own on this host: a network namespace with loopback and one Ethernet
/// interface, eth0, whose frames this program reads and writes. Made as root, or in a user
/// namespace. It belongs to descriptors alone: with this and the programs in it, it vanishes,
/// however they end.
class RobotNetwork {
 public:
  /// The network of robot `robot`, with ethernet_address() and 10.77.x.y/16, counted
  /// from 10.77.0.1. Throws std::runtime_error that says what the system does not allow, and the
  /// way out.
  explicit RobotNetwork(std::size_t robot);

  /// Frames that the robot sends, one for each read, and that it is to get, one for each write.
  /// Does not block.
  [[nodiscard]] int frames() const { return tap_.get(); }

  /// Moves the calling process, which must have one thread, into the network. Async-signal-safe.
  /// False, with errno, if it is not allowed.
  [[nodiscard]] bool enter() const;

 private:
  Descriptor tap_;
  Descriptor user_;  // none if made as root
  Descriptor network_;
};

/// "10.77.0.1" of robot 0.
[[nodiscard]] std::string network_address(std::size_t robot);

}  // namespace km
