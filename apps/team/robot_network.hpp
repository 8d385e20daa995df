#pragma once

#include <cstddef>
#include <string>

#include "apps/descriptor.hpp"

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

/// "10.77.0.1" for robot 0.
[[nodiscard]] std::string network_address(std::size_t robot);

}  // namespace km
