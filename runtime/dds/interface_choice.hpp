#pragma once

#include <optional>
#include <string>
#include <vector>

namespace km {

/// An IPv4 interface that is up.
struct NetworkInterface {
  std::string name;
  std::string address;  ///< Dotted.
  bool multicast = false;
  bool loopback = false;
  unsigned index = 0;  ///< Number of the device; another one after it was removed and added.

  bool operator==(const NetworkInterface&) const = default;
};

/// The interface called `name`. With an empty name: the first one that is not loopback,
/// multicast-capable ones first, or otherwise loopback. Throws ConfigError that lists the existing
/// ones if there is none.
NetworkInterface select_interface(const std::vector<NetworkInterface>& interfaces,
                                  const std::string& name);

/// Decides when DDS has to move to another interface or address. An interface that has gone is
/// awaited. If no name is configured, and the interface stays away, another one takes its place.
/// Time comes in [s], with any origin. Not thread-safe.
class InterfaceChoice {
 public:
  /// `name` as in select_interface(). `used`: loopback stands in for an interface that is not up.
  InterfaceChoice(std::string name, NetworkInterface used)
      : name_(std::move(name)), used_(std::move(used)), waits_(is_stand_in()) {}

  /// The interface to move to, which has been up for a second, or nullopt. `up`: all of the host.
  [[nodiscard]] std::optional<NetworkInterface> update(const std::vector<NetworkInterface>& up,
                                                       double now_s);
  void moved_to(NetworkInterface used);

  /// True while the interface in use has gone, or stands in for another one.
  [[nodiscard]] bool waits() const { return waits_; }

 private:
  [[nodiscard]] bool is_stand_in() const { return used_.loopback && name_ != used_.name; }
  [[nodiscard]] std::optional<NetworkInterface> candidate(const std::vector<NetworkInterface>& up,
                                                          double now_s) const;

  std::string name_;
  NetworkInterface used_;
  bool waits_;
  double gone_s_ = 0.0;                        // time at which `waits_` became true
  std::optional<NetworkInterface> candidate_;  // would be moved to if it stays
  double candidate_s_ = 0.0;                   // time at which it came
};

}  // namespace km
