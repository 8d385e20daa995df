#pragma once

#include <memory>
#include <string>
#include <vector>

#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/entity.hpp"
#include "runtime/dds/robot_identity.hpp"
#include "runtime/dds/shared_seal.hpp"

namespace km {

/// An IPv4 interface that is up.
struct NetworkInterface {
  std::string name;
  std::string address;  ///< Dotted.
  bool multicast = false;
  bool loopback = false;
};

/// Network interfaces of this host, in the kernel's order.
std::vector<NetworkInterface> network_interfaces();

/// The interface called `name`. With an empty name: the first one that is not loopback,
/// multicast-capable ones first, or otherwise loopback. Throws ConfigError that lists the existing
/// ones if there is none.
NetworkInterface select_interface(const std::vector<NetworkInterface>& interfaces,
                                  const std::string& name);

/// Looks up addresses or names of hosts, each with or without ":port". Throws ConfigError that
/// names all unknown ones. May query a name server, and wait for it.
void check_hosts(const std::vector<std::string>& hosts);

/// Configuration document of Cyclone DDS 0.10 for `config` on `interface`.
[[nodiscard]] std::string cyclone_xml(const DdsConfig& config, const NetworkInterface& interface);

/// A DDS domain configured for one link. DDS allows one configuration per domain and process, so
/// two of these with the same domain number cannot exist at once.
class DdsDomain {
 public:
  /// Throws ConfigError for an unusable `config`, DdsError if DDS refuses it.
  explicit DdsDomain(const DdsConfig& config);

  [[nodiscard]] const DdsConfig& config() const { return config_; }
  [[nodiscard]] const NetworkInterface& interface() const { return interface_; }

 private:
  DdsConfig config_;
  NetworkInterface interface_;
  DdsEntity domain_;
};

/// A robot's presence on the network: one per robot, whatever the number of its topics.
class DdsParticipant {
 public:
  /// Creates the domain as well: the case of one robot per process.
  DdsParticipant(const DdsConfig& config, const RobotIdentity& identity,
                 std::shared_ptr<SharedSeal> seal = nullptr);
  /// Joins a domain that several robots of one process share (tests).
  DdsParticipant(std::shared_ptr<const DdsDomain> domain, const RobotIdentity& identity,
                 std::shared_ptr<SharedSeal> seal = nullptr);

  [[nodiscard]] const RobotIdentity& identity() const { return identity_; }
  [[nodiscard]] const DdsConfig& config() const { return domain_->config(); }
  [[nodiscard]] const NetworkInterface& interface() const { return domain_->interface(); }
  [[nodiscard]] dds_entity_t handle() const { return participant_.handle(); }
  [[nodiscard]] const Guid& guid() const { return guid_; }
  /// Seal of all messages to and from other robots; null: they are sent unencrypted.
  [[nodiscard]] SharedSeal* seal() const { return seal_.get(); }

 private:
  std::shared_ptr<const DdsDomain> domain_;  // outlives the participant
  RobotIdentity identity_;
  std::shared_ptr<SharedSeal> seal_;
  DdsEntity participant_;
  Guid guid_{};
};

}  // namespace km
