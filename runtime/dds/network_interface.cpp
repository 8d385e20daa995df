#include "runtime/dds/network_interface.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <system_error>

#include "modules/core/config.hpp"

namespace km {
namespace {

// Empty if the host is known.
std::string why_unknown(const std::string& host) {
  const std::size_t colon = host.find(':');
  const std::string name = host.substr(0, colon);
  const std::string port = colon != host.npos ? host.substr(colon + 1) : "0";
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(name.c_str(), port.c_str(), &hints, &found);
  if (error != 0) return gai_strerror(error);
  freeaddrinfo(found);
  return {};
}

}  // namespace

std::vector<NetworkInterface> network_interfaces() {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0)
    throw std::system_error(errno, std::generic_category(), "cannot list the network interfaces");
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(first, &freeifaddrs);

  std::vector<NetworkInterface> interfaces;
  for (const ifaddrs* entry = first; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    if ((entry->ifa_flags & IFF_UP) == 0) continue;
    const auto* address = reinterpret_cast<const sockaddr_in*>(entry->ifa_addr);
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size());
    interfaces.push_back({.name = entry->ifa_name,
                          .address = text.data(),
                          .multicast = (entry->ifa_flags & IFF_MULTICAST) != 0,
                          .loopback = (entry->ifa_flags & IFF_LOOPBACK) != 0});
  }
  return interfaces;
}

NetworkInterface select_interface(const std::vector<NetworkInterface>& interfaces,
                                  const std::string& name) {
  const auto rank = [](const NetworkInterface& i) { return i.loopback ? 0 : i.multicast ? 2 : 1; };
  const NetworkInterface* best = nullptr;
  for (const NetworkInterface& candidate : interfaces) {
    if (!name.empty() && candidate.name != name) continue;
    if (best == nullptr || rank(candidate) > rank(*best)) best = &candidate;
  }
  if (best != nullptr) return *best;

  std::string known;
  for (const NetworkInterface& i : interfaces)
    known += (known.empty() ? "" : ", ") + i.name + " (" + i.address + ")";
  throw ConfigError(
      "dds.interface = " + (name.empty() ? "(any)" : name) +
      ": no such IPv4 interface is up; those up: " + (known.empty() ? "none" : known));
}

void check_hosts(const std::vector<std::string>& hosts) {
  std::string problems;
  for (const std::string& host : hosts)
    if (const std::string why = why_unknown(host); !why.empty())
      problems += (problems.empty() ? "" : "; ") + host + ": " + why;
  if (!problems.empty()) throw ConfigError("dds.peers: unknown host: " + problems);
}

}  // namespace km
