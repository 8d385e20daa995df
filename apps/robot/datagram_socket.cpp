#include "apps/robot/datagram_socket.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <random>
#include <system_error>

namespace km {
namespace {

std::string last_error() {
  return std::generic_category().message(errno);
}

sockaddr_in address_with(in_addr address, std::uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_addr = address;
  result.sin_port = htons(port);
  return result;
}

in_addr parsed(const std::string& dotted) {
  in_addr address{};
  inet_pton(AF_INET, dotted.c_str(), &address);
  return address;
}

std::string dotted(in_addr address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

template <typename T>
bool set_option(int socket, int level, int name, const T& value) {
  return setsockopt(socket, level, name, &value, sizeof value) == 0;
}

}  // namespace

DatagramSocket DatagramSocket::udp(std::uint16_t port) {
  DatagramSocket made(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const sockaddr_in any = address_with(in_addr{INADDR_ANY}, port);
  // Shared, as in DDS, because robots on one host use one port of discovery.
  const bool is_ready =
      made.handle() >= 0 && set_option(made.handle(), SOL_SOCKET, SO_REUSEADDR, 1) &&
      bind(made.handle(), reinterpret_cast<const sockaddr*>(&any), sizeof any) == 0;
  if (!is_ready)
    throw std::system_error(errno, std::generic_category(), "UDP port " + std::to_string(port));
  return made;
}

std::optional<DatagramSocket> DatagramSocket::icmp() {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, IPPROTO_ICMP);
  if (socket >= 0) return DatagramSocket(socket);
  const int raw = ::socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC, IPPROTO_ICMP);
  if (raw >= 0) return DatagramSocket(raw, true);
  return std::nullopt;
}

std::uint16_t DatagramSocket::port() const {
  sockaddr_in own{};
  socklen_t size = sizeof own;
  getsockname(handle(), reinterpret_cast<sockaddr*>(&own), &size);
  return ntohs(own.sin_port);
}

std::optional<std::string> DatagramSocket::join(const std::string& group,
                                                const std::string& interface_address) {
  ip_mreq request{};
  request.imr_multiaddr = parsed(group);
  request.imr_interface = parsed(interface_address);
  const bool joined = set_option(handle(), IPPROTO_IP, IP_ADD_MEMBERSHIP, request) &&
                      set_option(handle(), IPPROTO_IP, IP_MULTICAST_IF, request.imr_interface) &&
                      set_option(handle(), IPPROTO_IP, IP_MULTICAST_LOOP, 1);
  return joined ? std::nullopt : std::optional("cannot join " + group + ": " + last_error());
}

bool DatagramSocket::receive_own_groups_only() {
  return set_option(handle(), IPPROTO_IP, IP_MULTICAST_ALL, 0);
}

std::optional<std::string> DatagramSocket::send(const std::string& address, std::uint16_t port,
                                                const std::vector<std::uint8_t>& bytes) {
  const sockaddr_in to = address_with(parsed(address), port);
  const auto sent = sendto(handle(), bytes.data(), bytes.size(), 0,
                           reinterpret_cast<const sockaddr*>(&to), sizeof to);
  return sent >= 0 ? std::nullopt : std::optional("cannot send: " + last_error());
}

std::optional<DatagramSocket::Datagram> DatagramSocket::receive(
    std::chrono::milliseconds patience) {
  pollfd waiting{.fd = handle(), .events = POLLIN, .revents = 0};
  if (poll(&waiting, 1, static_cast<int>(patience.count())) <= 0) return std::nullopt;
  std::vector<std::uint8_t> bytes(65536);
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const auto count = recvfrom(handle(), bytes.data(), bytes.size(), MSG_DONTWAIT,
                              reinterpret_cast<sockaddr*>(&from), &size);
  if (count < 0) return std::nullopt;
  bytes.resize(static_cast<std::size_t>(count));
  if (has_ip_header_ && !bytes.empty()) {
    const std::size_t words = bytes[0] & 0x0fU;  // length in words of 4 bytes (RFC 791, Sec. 3.1)
    bytes.erase(bytes.begin(),
                bytes.begin() + std::min(std::ptrdiff_t(bytes.size()), std::ptrdiff_t(4 * words)));
  }
  return Datagram{dotted(from.sin_addr), std::move(bytes)};
}

std::vector<std::uint8_t> DatagramSocket::own_bytes(std::size_t size) {
  std::vector<std::uint8_t> bytes = {'K', 'M', 'D', 'R'};
  std::random_device device;
  for (int k = 0; k < 12; ++k) bytes.push_back(static_cast<std::uint8_t>(device()));
  bytes.resize(std::max(bytes.size(), size));
  return bytes;
}

}  // namespace km
