#pragma once

#include <string>
#include <vector>

namespace km {

/// An IPv4 interface that is up.
struct NetworkInterface {
  std::string name;
  std::string address;  ///< Dotted.
  bool multicast = false;
  bool loopback = false;
};

/// Those of this host, in the kernel's order.
std::vector<NetworkInterface> network_interfaces();

/// The one called `name`. With an empty name: the first that is not loopback, multicast-capable
/// ones first, or else loopback. Throws ConfigError if there is none, naming those that exist.
NetworkInterface select_interface(const std::vector<NetworkInterface>& interfaces,
                                  const std::string& name);

/// Looks up addresses or names of hosts, each with or without ":port". Throws ConfigError naming
/// all those that are unknown. May ask a name server, and wait for it.
void check_hosts(const std::vector<std::string>& hosts);

}  // namespace km
