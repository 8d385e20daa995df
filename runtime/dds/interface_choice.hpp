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
  unsigned index = 0;   ///< Number of the device; another one after it was removed and added.
  bool carrier = true;  ///< A cable, a radio network or a member of the bridge is connected.
  int routes = 0;       ///< Number of the other hosts to which the kernel sends through it.
  int mtu = 0;          ///< Largest packet that it takes, also on these routes [B]; 0: unknown.

  /// True for the same device with the same address.
  bool operator==(const NetworkInterface& other) const {
    return name == other.name && address == other.address && index == other.index;
  }
};

/// The interface called `name`. With an empty name: one with a carrier that is not loopback, with
/// the most routes, then one that is multicast-capable, then the first. If there is none: loopback.
/// Throws ConfigError that lists the existing ones if there is none.
NetworkInterface select_interface(const std::vector<NetworkInterface>& interfaces,
                                  const std::string& name);

/// Interfaces that select_interface() did not choose.
struct OtherInterfaces {
  std::string reasons;   ///< "docker0 has no carrier, tun0 carries no multicast"; empty: none.
  bool is_clear = true;  ///< False if one of them is as good as the chosen one.
};
[[nodiscard]] OtherInterfaces others_than(const NetworkInterface& chosen,
                                          const std::vector<NetworkInterface>& interfaces);

/// Decides when DDS has to move to another interface or address. An interface that has gone is
/// awaited, and so is its carrier. If no name is configured, and the interface stays away, another
/// one with a carrier takes its place. Time comes in [s], with any origin. Not thread-safe.
class InterfaceChoice {
 public:
  /// `name` as in select_interface(). `used`: loopback stands in for an interface that is not up.
  InterfaceChoice(std::string name, NetworkInterface used)
      : name_(std::move(name)), used_(std::move(used)), waits_(is_stand_in()) {}

  /// The interface to move to, which has been up for a second, or nullopt. `up`: all of the host.
  [[nodiscard]] std::optional<NetworkInterface> update(std::vector<NetworkInterface> up,
                                                       double now_s);
  void moved_to(NetworkInterface used);

  /// True while the interface in use has gone or has no carrier, or stands in for another one.
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
