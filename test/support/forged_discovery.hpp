#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

namespace km {

/// A program without keys that listens to the discovery of a DDS domain on loopback, and forges
/// packets of it (RTPS 2.2, sections 8.5 and 9.6). Errors throw std::system_error.
class ForgedDiscovery {
 public:
  explicit ForgedDiscovery(int domain);
  ~ForgedDiscovery();
  ForgedDiscovery(const ForgedDiscovery&) = delete;
  ForgedDiscovery& operator=(const ForgedDiscovery&) = delete;

  /// Listens until it has received the announcement of this robot.
  void record(int robot);

  /// Declares in the name of a recorded robot that its participant has gone.
  void dispose(int robot);

  /// Announces the participant of a recorded robot as that of no robot, or at useless addresses, by
  /// a packet that DDS takes for newer than all true ones.
  enum class Change { kUserData, kAddresses };
  void contradict(int robot, Change change);

  /// Announces `count` participants without an end that copy the announcement of a recorded robot.
  void invent(int robot, std::size_t count);

 private:
  using Packet = std::vector<std::uint8_t>;
  void send(const Packet& packet) const;

  int port_;
  int socket_;
  std::map<int, Packet> recorded_;  // announcement of each robot
  std::mt19937 rng_{1};
  std::uint32_t forged_ = 0;  // sequence number of the last forged packet
};

}  // namespace km
