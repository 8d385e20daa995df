#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/io/descriptor.hpp"

namespace km {

/// An IPv4 socket for datagrams: UDP, or ICMP echoes.
class DatagramSocket {
 public:
  struct Datagram {
    std::string from;  ///< Address, dotted.
    std::vector<std::uint8_t> bytes;
  };

  /// UDP on `port` (0: any) of all addresses, shared with other programs that listen there. Throws
  /// std::system_error.
  [[nodiscard]] static DatagramSocket udp(std::uint16_t port);
  /// Socket for ICMP echoes; nullopt if this user has no permission.
  [[nodiscard]] static std::optional<DatagramSocket> icmp();

  [[nodiscard]] int handle() const { return socket_.get(); }
  [[nodiscard]] std::uint16_t port() const;

  /// Joins `group` on the interface with this address. The socket then receives datagrams of the
  /// group, also its own, and sends to the group through this interface. Returns the reason if this
  /// fails.
  [[nodiscard]] std::optional<std::string> join(const std::string& group,
                                                const std::string& interface_address);
  /// Otherwise the socket also receives what comes to groups of other sockets. False if this fails.
  [[nodiscard]] bool receive_own_groups_only();

  /// Sends a datagram. Returns the reason if this fails.
  [[nodiscard]] std::optional<std::string> send(const std::string& address, std::uint16_t port,
                                                const std::vector<std::uint8_t>& bytes);
  /// The next datagram; nullopt if none arrives within `patience`.
  [[nodiscard]] std::optional<Datagram> receive(std::chrono::milliseconds patience);

  /// Random bytes that no other program sends, and that DDS drops as invalid, with zeros up to
  /// `size`.
  [[nodiscard]] static std::vector<std::uint8_t> own_bytes(std::size_t size = 16);

 private:
  explicit DatagramSocket(int socket, bool has_ip_header = false)
      : socket_(socket), has_ip_header_(has_ip_header) {}

  Descriptor socket_;
  bool has_ip_header_;  // true if received bytes begin with an IP header
};

}  // namespace km
