#include "test/support/forged_discovery.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

namespace km {
namespace {

constexpr std::size_t kGuidPrefixAt = 8, kGuidPrefix = 12;  // in the header of a packet
constexpr const char* kGroup = "239.255.0.1";

void check(int result, const char* purpose) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), purpose);
}

template <typename T>
void set_option(int socket, int level, int option, const T& value) {
  check(setsockopt(socket, level, option, &value, sizeof value), "cannot configure a socket");
}

sockaddr_in address_of(const char* host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  inet_pton(AF_INET, host, &address.sin_addr);
  return address;
}

void append(std::vector<std::uint8_t>& packet, std::initializer_list<int> bytes) {
  for (const int byte : bytes) packet.push_back(static_cast<std::uint8_t>(byte));
}

void append_prefix(std::vector<std::uint8_t>& packet, const std::vector<std::uint8_t>& of) {
  const auto prefix = of.begin() + kGuidPrefixAt;
  packet.insert(packet.end(), prefix, prefix + kGuidPrefix);
}

}  // namespace

ForgedDiscovery::ForgedDiscovery(int domain)
    : port_(7400 + 250 * domain), socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  check(socket_, "cannot make a socket");
  set_option(socket_, SOL_SOCKET, SO_REUSEADDR, 1);
  set_option(socket_, IPPROTO_IP, IP_MULTICAST_IF, in_addr{htonl(INADDR_LOOPBACK)});
  const sockaddr_in own = address_of("0.0.0.0", port_);
  check(bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own), "cannot bind");
  set_option(socket_, IPPROTO_IP, IP_ADD_MEMBERSHIP,
             ip_mreq{address_of(kGroup, port_).sin_addr, in_addr{htonl(INADDR_LOOPBACK)}});
}

ForgedDiscovery::~ForgedDiscovery() {
  close(socket_);
}

void ForgedDiscovery::record(int robot) {
  const std::string announced = "robot=" + std::to_string(robot) + ';';
  while (!recorded_.contains(robot)) {
    Packet packet(65536);
    const auto size = recv(socket_, packet.data(), packet.size(), 0);
    check(static_cast<int>(size), "cannot receive");
    packet.resize(static_cast<std::size_t>(size));
    if (!std::ranges::search(packet, announced).empty()) recorded_.emplace(robot, packet);
  }
}

void ForgedDiscovery::dispose(int robot) {
  const Packet& announcement = recorded_.at(robot);
  const auto number = static_cast<int>(++forged_);
  Packet packet(announcement.begin(), announcement.begin() + kGuidPrefixAt);
  append_prefix(packet, announcement);
  // DATA of the writer of participants, with the state "disposed and unregistered" and the key.
  append(packet, {0x15, 1 | 2 | 8, 60, 0, 0, 0, 16, 0, 0, 1, 0, 0xc7, 0, 1, 0, 0xc2});
  append(packet, {0, 0, 0, 0, number, 0, 0, 0, 0x71, 0, 4, 0, 0, 0, 0, 3, 1, 0, 0, 0});
  append(packet, {0, 3, 0, 0, 0x50, 0, 16, 0});
  append_prefix(packet, announcement);
  append(packet, {0, 0, 1, 0xc1, 1, 0, 0, 0});
  send(packet);
}

void ForgedDiscovery::contradict(int robot, Change change) {
  Packet packet = recorded_.at(robot);
  // Sequence number of the DATA of the writer of participants: 32 high bits, 32 low bits.
  constexpr std::array<std::uint8_t, 4> kWriter{0, 1, 0, 0xc2};
  const auto number = std::ranges::search(packet, kWriter).end();
  constexpr std::array<std::uint8_t, 8> kHigh{0, 0, 0, 0, 0, 0, 1, 0};
  std::ranges::copy(kHigh, number);
  if (change == Change::kUserData) {
    constexpr std::array<std::uint8_t, 6> kRobot{'r', 'o', 'b', 'o', 't', '='};
    constexpr std::array<std::uint8_t, 6> kLiar{'l', 'i', 'a', 'r', '!', '='};
    std::ranges::copy(kLiar, std::ranges::search(packet, kRobot).begin());
    return send(packet);
  }
  // PID_METATRAFFIC_UNICAST_LOCATOR and PID_DEFAULT_UNICAST_LOCATOR: kind and port, 4 bytes each.
  for (const std::uint8_t id : std::array<std::uint8_t, 2>{0x31, 0x32}) {
    const std::array<std::uint8_t, 8> locator{id, 0, 24, 0, 1, 0, 0, 0};
    std::ranges::copy(std::array<std::uint8_t, 2>{9, 0},
                      std::ranges::search(packet, locator).end());
  }
  send(packet);
}

void ForgedDiscovery::invent(int robot, std::size_t count) {
  Packet packet = recorded_.at(robot);
  // Parameter PID_PARTICIPANT_LEASE_DURATION, whose value are seconds and a fraction.
  constexpr std::array<std::uint8_t, 4> kLease{2, 0, 8, 0};
  constexpr std::array<std::uint8_t, 4> kLongestTime_s{0xff, 0xff, 0xff, 0x7f};
  std::ranges::copy(kLongestTime_s, std::ranges::search(packet, kLease).end());
  Packet prefix;
  append_prefix(prefix, packet);
  std::vector<Packet::iterator> places;
  for (auto at = packet.begin();
       (at = std::search(at, packet.end(), prefix.begin(), prefix.end())) != packet.end(); ++at)
    places.push_back(at);
  std::uniform_int_distribution<int> byte(0, 255);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::uint8_t& b : prefix) b = static_cast<std::uint8_t>(byte(rng_));
    for (const auto& place : places) std::ranges::copy(prefix, place);
    send(packet);
  }
}

void ForgedDiscovery::send(const Packet& packet) const {
  const sockaddr_in all = address_of(kGroup, port_);
  check(static_cast<int>(sendto(socket_, packet.data(), packet.size(), 0,
                                reinterpret_cast<const sockaddr*>(&all), sizeof all)),
        "cannot send");
}

}  // namespace km
