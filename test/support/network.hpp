#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace km {

/// Hosts on one switch, as network namespaces of this machine. They belong to processes that end
/// with this one, and vanish with them, however a test ends.
class VirtualNetwork {
 public:
  /// True if this process may make namespaces; otherwise prints SKIPPED, for ctest.
  static bool available();

  /// Hosts 1 to `count` with addresses 10.77.0.<n> on interface eth0. Throws std::runtime_error.
  explicit VirtualNetwork(int count);
  ~VirtualNetwork();
  VirtualNetwork(const VirtualNetwork&) = delete;
  VirtualNetwork& operator=(const VirtualNetwork&) = delete;

  /// A process in whose network namespace programs of `host` run.
  [[nodiscard]] pid_t host(int host) const { return hosts_[static_cast<std::size_t>(host) - 1]; }
  [[nodiscard]] static std::string address(int host) { return "10.77.0." + std::to_string(host); }

  /// Disconnects or connects the cable of `host`.
  void set_link(int host, bool up);

  /// Connects `a` and `b`, as at first, or disconnects them; other hosts still receive both. This
  /// models robots on one radio channel of which some are out of reach.
  void set_link_between(int a, int b, bool up);

  /// Gives eth0 of `host` another address, for instance "10.77.0.102/24", or none.
  void set_address(int host, const std::string& address);

  /// Leaves `host` with only the loopback interface.
  void remove_interface(int host);
  /// Connects `host` again after remove_interface(); eth0 is another device now, without address.
  void add_interface(int host);

  /// Larger packets to `host` are dropped on the way, without a notice to the sender.
  void set_path_mtu(int host, int bytes);

  /// Gives `host` a second interface, "eth1", that leads nowhere: a bridge without members.
  void add_dead_interface(int host);

 private:
  pid_t switch_ = 0;
  std::vector<pid_t> hosts_;
};

}  // namespace km
