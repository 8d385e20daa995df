#include "runtime/dds/domain_draw.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "modules/core/io/descriptor.hpp"

namespace km {
namespace {

bool is_taken(unsigned port) {
  if (port > std::numeric_limits<std::uint16_t>::max()) return false;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  const Descriptor tried(socket(AF_INET, SOCK_DGRAM, 0));
  return tried.get() >= 0 &&
         bind(tried.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 &&
         errno == EADDRINUSE;
}

// True if a program on this host takes part in the domain, whether it has drawn it or not. It has
// the port of multicast, or one of the first ports of unicast (RTPS 2.3, 9.6.1).
bool has_participant(unsigned domain) {
  constexpr unsigned kPorts = 7400, kPortsOfDomain = 250, kUnicast = 10, kParticipants = 10;
  const unsigned multicast = kPorts + kPortsOfDomain * domain;
  if (is_taken(multicast)) return true;
  for (unsigned i = 0; i < kParticipants; ++i)
    if (is_taken(multicast + kUnicast + 2 * i)) return true;
  return false;
}

// Takes the domain by an abstract socket address. Such an address belongs to one network namespace,
// as the ports of a domain do. The kernel frees it with the last process that has the socket.
bool take_domain(unsigned domain) {
  const std::string name = "kimera_multi/domain/" + std::to_string(domain);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path + 1, name.data(), name.size());
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  const int taken = socket(AF_UNIX, SOCK_DGRAM, 0);
  if (taken < 0)
    throw std::system_error(errno, std::generic_category(), "cannot take a DDS domain");
  if (bind(taken, reinterpret_cast<const sockaddr*>(&address), size) == 0 &&
      !has_participant(domain))
    return true;
  close(taken);
  return false;
}

}  // namespace

unsigned draw_domain(unsigned first, unsigned last) {
  std::vector<unsigned> domains(last + 1 - first);
  std::iota(domains.begin(), domains.end(), first);
  std::shuffle(domains.begin(), domains.end(), std::random_device());
  const auto drawn = std::find_if(domains.begin(), domains.end(), take_domain);
  if (drawn == domains.end())
    throw std::runtime_error("all DDS domains from " + std::to_string(first) + " to " +
                             std::to_string(last) +
                             " are taken by programs on this host: choose one with --domain");
  return *drawn;
}

}  // namespace km
