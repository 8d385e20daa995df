#pragma once

#include <memory>
#include <optional>
#include <shared_mutex>
#include <string>
#include <vector>

#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/entity.hpp"
#include "runtime/dds/interface_choice.hpp"
#include "runtime/dds/robot_identity.hpp"
#include "runtime/dds/shared_seal.hpp"

namespace km {

/// Part of the configuration of a domain. Several receive threads end only when they receive a
/// packet, which a program cannot send to itself behind a firewall or once its address has gone.
inline constexpr const char* kOneReceiveThread =
    "<MultipleReceiveThreads>false</MultipleReceiveThreads>";

/// IPv4 interfaces of this host that are up, in the kernel's order. Their routes are those to the
/// IPv4 addresses (with or without ":port") in `hosts`; names are ignored. If there is none, it is
/// the route of multicast, which is the default route on most hosts.
std::vector<NetworkInterface> network_interfaces(const std::vector<std::string>& hosts = {});

/// Looks up addresses or names of hosts, each with or without ":port". Throws ConfigError that
/// names all unknown ones. May query a name server, and wait for it.
void check_hosts(const std::vector<std::string>& hosts);

/// Largest UDP datagram that robots send on `interface` [B]: fits into one packet, because some
/// networks drop fragments of packets. At most dds.max_message_bytes.
[[nodiscard]] int largest_datagram(const DdsConfig& config, const NetworkInterface& interface);

/// Configuration document of Cyclone DDS 0.10 for `config` on `interface`.
[[nodiscard]] std::string cyclone_xml(const DdsConfig& config, const NetworkInterface& interface);

/// A DDS domain configured for one link. DDS allows one configuration per domain and process, so
/// two of these with the same domain number cannot exist at once.
class DdsDomain {
 public:
  /// Throws ConfigError for an unusable `config`, DdsError if DDS refuses it.
  explicit DdsDomain(const DdsConfig& config);
  DdsDomain(const DdsConfig& config, NetworkInterface interface);
  /// Removes all entities of the domain. Waits for a bounded time: if DDS hangs, they are left.
  ~DdsDomain();
  DdsDomain(const DdsDomain&) = delete;
  DdsDomain& operator=(const DdsDomain&) = delete;

  [[nodiscard]] const DdsConfig& config() const { return config_; }
  [[nodiscard]] const NetworkInterface& interface() const { return interface_; }

 private:
  DdsConfig config_;
  NetworkInterface interface_;
  DdsEntity domain_;
};

/// A robot's presence on the network: one per robot, whatever the number of its topics.
///
/// DDS uses the address that its interface has when the domain is created. So domain, participant
/// and all entities of the participant are made again when the interface or its address changes.
/// The receive thread of DdsBridge does so, and it owns all entities for receiving. Any other
/// thread holds use() while it uses entities.
class DdsParticipant {
 public:
  /// Creates the domain as well: the case of one robot per process. While the interface of `config`
  /// is not up, the participant is on loopback.
  DdsParticipant(const DdsConfig& config, const RobotIdentity& identity,
                 std::shared_ptr<SharedSeal> seal = nullptr);
  /// Joins a domain that several robots of one process share (tests).
  DdsParticipant(std::shared_ptr<const DdsDomain> domain, const RobotIdentity& identity,
                 std::shared_ptr<SharedSeal> seal = nullptr);

  /// While the result exists, the entities stay. Waits while they are made again. A thread must not
  /// hold two of them.
  [[nodiscard]] std::shared_lock<std::shared_mutex> use() const;
  /// As use(), for the thread that makes them again: waits until no other thread uses them.
  [[nodiscard]] std::unique_lock<std::shared_mutex> use_alone() const;

  /// The interface to which DDS has to move, if any. Logs when the interface goes and returns.
  [[nodiscard]] std::optional<NetworkInterface> new_interface(double now_s);
  /// Makes domain and participant again, on `interface`, or on loopback if that fails. All entities
  /// of the former participant are gone then. Precondition: the caller has use_alone(). Throws
  /// DdsError.
  void move_to(const NetworkInterface& interface);
  /// False while its interface has gone, or if it shares its domain.
  [[nodiscard]] bool can_move() const {
    return choice_ && (!choice_->waits() || interface().loopback);
  }
  /// Number of calls of move_to(). Call with use().
  [[nodiscard]] std::uint64_t moves() const { return moves_; }

  [[nodiscard]] const RobotIdentity& identity() const { return identity_; }
  [[nodiscard]] const DdsConfig& config() const { return domain_->config(); }
  [[nodiscard]] const NetworkInterface& interface() const { return domain_->interface(); }
  [[nodiscard]] dds_entity_t handle() const { return participant_.handle(); }
  [[nodiscard]] const Guid& guid() const { return guid_; }
  /// Seal of all messages to and from other robots; null: they are sent unencrypted.
  [[nodiscard]] SharedSeal* seal() const { return seal_.get(); }

 private:
  void join();

  mutable std::mutex queue_;                 // lets use_alone() wait for a bounded time
  mutable std::shared_mutex users_;          // guards the entities
  std::shared_ptr<const DdsDomain> domain_;  // outlives the participant
  RobotIdentity identity_;
  std::shared_ptr<SharedSeal> seal_;
  DdsEntity participant_;
  Guid guid_{};
  std::uint64_t moves_ = 0;
  std::optional<InterfaceChoice> choice_;  // empty if robots share the domain
  double looked_s_ = 0.0;
};

}  // namespace km
