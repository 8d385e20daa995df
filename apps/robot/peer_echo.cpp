#include "apps/robot/peer_echo.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <vector>

#include "apps/robot/datagram_socket.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

// IPv4 address of a host as dotted text; nullopt if unknown. `host` is a name or an address, with
// or without ":port".
std::optional<std::string> address_of(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.substr(0, host.find(':')).c_str(), nullptr, &hints, &found) != 0)
    return std::nullopt;
  const in_addr address = reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr;
  freeaddrinfo(found);
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

constexpr std::size_t kEchoesUnanswered = 4;  // a host that answers none of these is silent

std::uint16_t checksum(const std::vector<std::uint8_t>& bytes) {
  std::uint32_t sum = 0;
  for (std::size_t k = 0; k + 1 < bytes.size(); k += 2)
    sum += static_cast<std::uint32_t>(bytes[k] << 8U | bytes[k + 1]);
  while (sum >> 16U != 0) sum = (sum & 0xffffU) + (sum >> 16U);
  return static_cast<std::uint16_t>(~sum);
}

// RFC 792: type 8, code 0, checksum, identifier, sequence number, and `data`, which the reply
// repeats.
std::vector<std::uint8_t> echo_request(const std::vector<std::uint8_t>& data) {
  std::vector<std::uint8_t> bytes(8, 0);
  bytes[0] = 8;
  bytes.insert(bytes.end(), data.begin(), data.end());
  const std::uint16_t sum = checksum(bytes);
  bytes[2] = static_cast<std::uint8_t>(sum >> 8U);
  bytes[3] = static_cast<std::uint8_t>(sum & 0xffU);
  return bytes;
}

bool is_echo(const std::vector<std::uint8_t>& bytes, const std::vector<std::uint8_t>& data) {
  return bytes.size() == 8 + data.size() && bytes[0] == 0 &&
         std::equal(data.begin(), data.end(), bytes.begin() + 8);
}

// Time until a request with `data` is answered.
std::optional<double> echo_s(DatagramSocket& socket, const std::string& address,
                             const std::vector<std::uint8_t>& data) {
  const double start_s = steady_now_s();
  if (socket.send(address, 0, echo_request(data))) return std::nullopt;
  while (steady_now_s() - start_s < 0.5) {
    const auto answer = socket.receive(std::chrono::milliseconds(100));
    if (answer && is_echo(answer->bytes, data)) return steady_now_s() - start_s;
  }
  return std::nullopt;
}

// The largest packet that passes [B], if one of `packet_bytes` does not.
int largest_passing(DatagramSocket& socket, const std::string& address, int packet_bytes) {
  constexpr int kHeaders_bytes = 20 + 8, kTries = 3, kStep_bytes = 4;
  const auto passes = [&](int bytes) {
    for (int k = 0; k < kTries; ++k)
      if (echo_s(socket, address,
                 DatagramSocket::own_bytes(static_cast<std::size_t>(bytes - kHeaders_bytes))))
        return true;
    return false;
  };
  if (passes(packet_bytes)) return packet_bytes;
  int low = 44, high = packet_bytes;  // the usual echo passes
  while (high - low > kStep_bytes) {
    const int middle = (low + high) / 4 * 2;  // even, because of the checksum
    (passes(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace

PeerEcho ask_peer(const std::string& host, int packet_bytes, std::size_t echoes) {
  PeerEcho echo{.host = host,
                .median_s = std::numeric_limits<double>::quiet_NaN(),
                .worst_s = std::numeric_limits<double>::quiet_NaN()};
  const auto address = address_of(host);
  auto socket = DatagramSocket::icmp();
  echo.may_send_icmp = socket.has_value();
  if (!socket || !address) return echo;
  std::vector<double> times_s;
  const auto is_silent = [&] { return times_s.empty() && echo.sent >= kEchoesUnanswered; };
  for (; echo.sent < echoes && !is_silent(); ++echo.sent)
    if (const auto time_s = echo_s(*socket, *address, DatagramSocket::own_bytes()))
      times_s.push_back(*time_s);
  echo.received = times_s.size();
  if (times_s.empty()) return echo;
  std::ranges::sort(times_s);
  echo.median_s = times_s[times_s.size() / 2];
  echo.worst_s = times_s.back();
  echo.packet_bytes = packet_bytes / 2 * 2;
  echo.passing_bytes = largest_passing(*socket, *address, echo.packet_bytes);
  return echo;
}

std::optional<Finding> path_finding(const PeerEcho& peer) {
  if (peer.passing_bytes >= peer.packet_bytes) return std::nullopt;
  const std::string bytes = std::to_string(peer.passing_bytes);
  return Finding{.id = "network.path_mtu",
                 .severity = Severity::kError,
                 .what = peer.host + " answers packets of up to " + bytes + " B, but none of " +
                         std::to_string(peer.packet_bytes) + " B",
                 .means =
                     "statuses arrive, keyframes and closures do not: the robots meet and "
                     "never join",
                 .to_do = "set dds.max_message_bytes to " +
                          std::to_string(peer.passing_bytes - 28) +
                          " on all robots, or the MTU of their interfaces to " + bytes};
}

}  // namespace km
