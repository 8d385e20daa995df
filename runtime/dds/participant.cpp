#include "runtime/dds/participant.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/if_bridge.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <netdb.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <future>
#include <sstream>
#include <string_view>
#include <system_error>

#include "modules/core/config.hpp"
#include "modules/core/io/descriptor.hpp"
#include "modules/core/io/xml_text.hpp"
#include "runtime/log.hpp"
#include "runtime/thread.hpp"

namespace km {
namespace {

// No topic has larger messages (see Codec::kMaxBytes); DDS does not put larger ones together.
constexpr int kMaxSampleBytes = (1 << 24) + 65536;

// Empty if the host is known.
std::string why_unknown(const std::string& host) {
  const std::size_t colon = host.find(':');
  const std::string name = host.substr(0, colon);
  const std::string port = colon != host.npos ? host.substr(colon + 1) : "0";
  if (std::ranges::count(host, ':') > 1) return "an IPv6 address: robots use IPv4";
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(name.c_str(), port.c_str(), &hints, &found);
  if (error != 0) return gai_strerror(error);
  freeaddrinfo(found);
  return {};
}

// A socket that sends nothing, to ask the kernel.
class QuerySocket {
 public:
  QuerySocket() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}

  // 0 if unknown.
  [[nodiscard]] int mtu_of(const char* interface) const {
    ifreq request{};
    std::strncpy(request.ifr_name, interface, IFNAMSIZ - 1);
    return ioctl(socket_.get(), SIOCGIFMTU, &request) == 0 ? request.ifr_mtu : 0;
  }

  // True for a bridge without members, for instance of containers: it has a carrier nevertheless.
  [[nodiscard]] bool is_empty_bridge(const char* interface) const {
    using Arguments = std::array<unsigned long, 4>;  // see if_bridge.h
    std::array<int, 256> bridges{}, members{};
    Arguments list = {BRCTL_GET_BRIDGES, reinterpret_cast<unsigned long>(bridges.data()), 256, 0};
    const int index = static_cast<int>(if_nametoindex(interface));
    if (ioctl(socket_.get(), SIOCGIFBR, list.data()) <= 0 ||
        std::ranges::count(bridges, index) == 0)
      return false;
    Arguments ports = {BRCTL_GET_PORT_LIST, reinterpret_cast<unsigned long>(members.data()), 256,
                       0};
    ifreq request{};
    std::strncpy(request.ifr_name, interface, IFNAMSIZ - 1);
    request.ifr_data = reinterpret_cast<char*>(ports.data());
    return ioctl(socket_.get(), SIOCDEVPRIVATE, &request) >= 0 &&
           std::ranges::count(members, 0) == 256;
  }

  struct Route {
    std::string own_address;  // dotted; empty: no route
    int mtu = 0;
  };
  [[nodiscard]] Route route_to(in_addr host) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(7400);
    address.sin_addr = host;
    socklen_t size = sizeof address, mtu_size = sizeof(int);
    Route route;
    if (connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
        getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
        getsockopt(socket_.get(), IPPROTO_IP, IP_MTU, &route.mtu, &mtu_size) != 0)
      return {};
    route.own_address = dotted(address.sin_addr);
    return route;
  }

  [[nodiscard]] static std::string dotted(in_addr address) {
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &address, text.data(), text.size());
    return text.data();
  }

 private:
  Descriptor socket_;
};

void add_routes(const std::vector<std::string>& hosts, std::vector<NetworkInterface>& interfaces) {
  const auto add = [&interfaces](const std::string& host, bool needs_multicast) {
    in_addr address{};
    if (inet_pton(AF_INET, host.substr(0, host.find(':')).c_str(), &address) != 1) return false;
    const QuerySocket::Route route = QuerySocket().route_to(address);
    for (NetworkInterface& interface : interfaces)
      if (interface.address == route.own_address && (interface.multicast || !needs_multicast)) {
        ++interface.routes;
        interface.mtu = std::min(interface.mtu, route.mtu);
      }
    return true;
  };
  std::size_t known = 0;
  for (const std::string& host : hosts) known += add(host, false) ? 1 : 0;
  constexpr const char* kGroup = "239.255.0.1";  // group of discovery (RTPS 2.5, Sec. 9.6.1.4)
  if (known == 0) add(kGroup, true);
}

std::string milliseconds(double seconds) {
  return std::to_string(std::llround(seconds * 1e3)) + "ms";
}

void write_general(std::ostream& xml, const DdsConfig& config, const NetworkInterface& interface) {
  constexpr int kRexmit_bytes = 1456;  // as DDS by default
  constexpr int kFragmentHeaders_bytes = 100;
  const int largest = largest_datagram(config, interface);
  const bool multicast = config.discovery == Discovery::kMulticast;
  xml << "<General><Interfaces><NetworkInterface name='" << xml_escaped(interface.name) << '\'';
  // Linux does not flag loopback as capable of multicast, yet it is.
  if (multicast && interface.loopback) xml << " multicast='true'";
  // Data use unicast: on radio, multicast runs at the base rate and without acknowledgement.
  xml << "/></Interfaces><AllowMulticast>" << (multicast ? "spdp" : "false")
      << "</AllowMulticast><MaxMessageSize>" << largest
      << "B</MaxMessageSize><MaxRexmitMessageSize>" << std::min(largest, kRexmit_bytes)
      << "B</MaxRexmitMessageSize><FragmentSize>"
      << std::min(config.fragment_bytes, largest - kFragmentHeaders_bytes)
      << "B</FragmentSize></General>";
}

// Discovery ports of the robots 0, 1, ... of a host: the port mapping of RTPS with its default
// parameters.
int discovery_port(int domain, int index) {
  return 7400 + 250 * domain + 10 + 2 * index;
}

// Writes this host without ports, so that DDS asks all of its ports, which costs nothing on the
// network. On other hosts each port costs a packet, so only robots_per_peer ports are listed.
void write_peers(std::ostream& xml, const DdsConfig& config, const std::string& own_address) {
  xml << "<Peers><Peer address='" << own_address << "'/>";
  for (const std::string& peer : config.peers) {
    if (peer == own_address) continue;
    if (peer.find(':') != std::string::npos) {
      xml << "<Peer address='" << xml_escaped(peer) << "'/>";
      continue;
    }
    for (int i = 0; i < config.robots_per_peer; ++i)
      xml << "<Peer address='" << xml_escaped(peer) << ':' << discovery_port(config.domain, i)
          << "'/>";
  }
  xml << "</Peers>";
}

void write_discovery(std::ostream& xml, const DdsConfig& config,
                     const NetworkInterface& interface) {
  const bool by_address = config.discovery == Discovery::kPeers || !config.peers.empty();
  // Fixed ports are needed only if robots are found by address. Without them any number of robots
  // fits on one host.
  xml << "<Discovery><ParticipantIndex>" << (by_address ? "auto" : "none")
      << "</ParticipantIndex><MaxAutoParticipantIndex>" << config.max_participant_index
      << "</MaxAutoParticipantIndex><LeaseDuration>" << milliseconds(config.lease_s)
      << "</LeaseDuration><SPDPInterval>" << milliseconds(config.spdp_interval_s)
      << "</SPDPInterval><Tag>" << xml_escaped(config.team) << "</Tag>";
  if (by_address) write_peers(xml, config, interface.address);
  xml << "</Discovery>";
}

void write_internal(std::ostream& xml, const DdsConfig& config) {
  xml << "<Internal><SocketReceiveBufferSize max='" << config.receive_buffer_bytes
      << "B'/><BurstSize><MaxRexmit>" << config.max_rexmit_bytes << "B</MaxRexmit>";
  if (config.max_init_transmit_percent >= 0)
    xml << "<MaxInitTransmit>" << config.max_init_transmit_percent << "</MaxInitTransmit>";
  xml << "</BurstSize><MaxSampleSize>" << kMaxSampleBytes << "B</MaxSampleSize><NackDelay>"
      << milliseconds(config.nack_delay_ms * 1e-3) << "</NackDelay>" << kOneReceiveThread
      << "<Watermarks><WhcHigh>64MB</WhcHigh><WhcHighInit>64MB</WhcHighInit>"
         "<WhcAdaptive>false</WhcAdaptive></Watermarks></Internal>";
}

// DDS reports trouble with the network here, from its own threads.
void log_line(void* /*argument*/, const dds_log_data_t* data) {
  std::string_view text(data->message);
  while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  const bool severe = (data->priority & (DDS_LC_FATAL | DDS_LC_ERROR)) != 0;
  const auto level = severe ? log::Level::kError : log::Level::kWarn;
  // A dead link fails every packet in the same way, so the limit applies to the kind of message: it
  // does not see addresses.
  std::string kind(text);
  std::erase_if(kind, [](char c) { return c >= '.' && c <= ':'; });
  log::limited(level, "dds", kind.substr(0, 24)) << text;
}

NetworkInterface choose_interface(const DdsConfig& config,
                                  const std::vector<NetworkInterface>& interfaces) {
  NetworkInterface chosen = select_interface(interfaces, config.interface);
  if (const auto others = others_than(chosen, interfaces);
      config.interface.empty() && !others.reasons.empty()) {
    const std::string text =
        "using network interface " + chosen.name + " (" + chosen.address + "): " + others.reasons;
    if (others.is_clear)
      log::info("dds") << text;
    else
      log::warn("dds") << text << "; set dds.interface to choose";
  }
  if (!chosen.multicast && !chosen.loopback && config.discovery == Discovery::kMulticast &&
      config.peers.empty())
    log::warn("dds") << chosen.name
                     << " carries no multicast: name the other robots' addresses in dds.peers";
  // Without a network, names of hosts cannot be looked up yet.
  if (!chosen.loopback || chosen.name == config.interface) check_hosts(config.peers);
  return chosen;
}

// Loopback stands in for an interface that is not up.
std::shared_ptr<const DdsDomain> make_domain(const DdsConfig& config) {
  const auto up = network_interfaces(config.peers);
  const bool is_up = config.interface.empty() ||
                     std::ranges::count(up, config.interface, &NetworkInterface::name) > 0;
  return std::make_shared<const DdsDomain>(
      config, is_up ? choose_interface(checked(config), up) : select_interface(up, "lo"));
}

dds_entity_t create_participant(const DdsConfig& config, const RobotIdentity& identity,
                                const SharedSeal* seal) {
  const std::string user_data =
      to_user_data(identity, seal != nullptr ? seal->credentials() : std::string());
  const DdsQos qos = make_dds_qos();
  dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  dds_qset_entity_name(qos.get(), identity.name.c_str());
  return dds_create_participant(static_cast<dds_domainid_t>(config.domain), qos.get(), nullptr);
}

}  // namespace

std::vector<NetworkInterface> network_interfaces(const std::vector<std::string>& hosts) {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0)
    throw std::system_error(errno, std::generic_category(), "cannot list the network interfaces");
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(first, &freeifaddrs);

  std::vector<NetworkInterface> interfaces;
  for (const ifaddrs* entry = first; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    if ((entry->ifa_flags & IFF_UP) == 0) continue;
    const auto* address = reinterpret_cast<const sockaddr_in*>(entry->ifa_addr);
    interfaces.push_back({.name = entry->ifa_name,
                          .address = QuerySocket::dotted(address->sin_addr),
                          .multicast = (entry->ifa_flags & IFF_MULTICAST) != 0,
                          .loopback = (entry->ifa_flags & IFF_LOOPBACK) != 0,
                          .index = if_nametoindex(entry->ifa_name),
                          .carrier = (entry->ifa_flags & IFF_RUNNING) != 0 &&
                                     !QuerySocket().is_empty_bridge(entry->ifa_name),
                          .mtu = QuerySocket().mtu_of(entry->ifa_name)});
  }
  add_routes(hosts, interfaces);
  return interfaces;
}

void check_hosts(const std::vector<std::string>& hosts) {
  std::string problems;
  for (const std::string& host : hosts)
    if (const std::string why = why_unknown(host); !why.empty())
      problems += (problems.empty() ? "" : "; ") + host + ": " + why;
  if (!problems.empty()) throw ConfigError("dds.peers: unknown host: " + problems);
}

int largest_datagram(const DdsConfig& config, const NetworkInterface& interface) {
  constexpr int kHeaders_bytes = 20 + 8;  // IPv4 and UDP
  return interface.mtu > 0 ? std::min(config.max_message_bytes, interface.mtu - kHeaders_bytes)
                           : config.max_message_bytes;
}

std::string cyclone_xml(const DdsConfig& config, const NetworkInterface& interface) {
  std::ostringstream xml;
  xml << "<CycloneDDS><Domain id='any'>";
  write_general(xml, config, interface);
  write_discovery(xml, config, interface);
  write_internal(xml, config);
  xml << "</Domain></CycloneDDS>";
  return xml.str();
}

DdsDomain::DdsDomain(const DdsConfig& config)
    : DdsDomain(checked(config),
                choose_interface(checked(config), network_interfaces(config.peers))) {}

DdsDomain::DdsDomain(const DdsConfig& config, NetworkInterface interface)
    : config_(checked(config)), interface_(std::move(interface)) {
  dds_set_log_mask(DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING);
  dds_set_log_sink(&log_line, nullptr);
  domain_ = DdsEntity(dds_create_domain(static_cast<dds_domainid_t>(config_.domain),
                                        cyclone_xml(config_, interface_).c_str()),
                      "DDS domain " + std::to_string(config_.domain) + " on interface " +
                          interface_.name +
                          (config_.domain > static_cast<int>(kLastQuietDomain)
                               ? " (other programs may use its ports, but not those up to domain " +
                                     std::to_string(kLastQuietDomain) + ")"
                               : ""));
}

DdsDomain::~DdsDomain() {
  constexpr std::chrono::seconds kLongest{5};
  std::packaged_task<void()> remove([domain = std::move(domain_)]() mutable { domain.reset(); });
  const auto removed = remove.get_future();
  start_without_signals(std::move(remove)).detach();
  if (removed.wait_for(kLongest) != std::future_status::ready)
    log::warn("dds") << "DDS does not end on interface " << interface_.name << " ("
                     << interface_.address << "): it is abandoned";
}

DdsParticipant::DdsParticipant(const DdsConfig& config, const RobotIdentity& identity,
                               std::shared_ptr<SharedSeal> seal)
    : DdsParticipant(make_domain(config), identity, std::move(seal)) {
  choice_.emplace(config.interface, interface());
  if (choice_->waits())
    log::warn("dds") << (config.interface.empty()
                             ? "no network interface has an IPv4 address and a carrier"
                             : "interface " + config.interface + " has no IPv4 address or is down")
                     << ": waiting for it; until then this robot meets only robots on this host";
}

DdsParticipant::DdsParticipant(std::shared_ptr<const DdsDomain> domain,
                               const RobotIdentity& identity, std::shared_ptr<SharedSeal> seal)
    : domain_(std::move(domain)), identity_(identity), seal_(std::move(seal)) {
  join();
}

void DdsParticipant::join() {
  participant_ = DdsEntity(create_participant(domain_->config(), identity_, seal_.get()),
                           "DDS participant (are there more than dds.max_participant_index robots "
                           "on this host?)");
  dds_guid_t guid{};
  check_dds(dds_get_guid(participant_.handle(), &guid), "cannot read the participant's identity");
  guid_ = to_guid(guid);
}

std::shared_lock<std::shared_mutex> DdsParticipant::use() const {
  const std::lock_guard turn(queue_);
  return std::shared_lock(users_);
}

std::unique_lock<std::shared_mutex> DdsParticipant::use_alone() const {
  const std::lock_guard turn(queue_);
  return std::unique_lock(users_);
}

std::optional<NetworkInterface> DdsParticipant::new_interface(double now_s) {
  constexpr double kPeriod_s = 0.5;
  if (!choice_ || now_s - looked_s_ < kPeriod_s) return std::nullopt;
  looked_s_ = now_s;
  const bool waited = choice_->waits();
  const auto next = choice_->update(network_interfaces(config().peers), now_s);
  const NetworkInterface& used = interface();
  if (choice_->waits() && !waited)
    log::warn("dds") << "interface " << used.name << " (" << used.address
                     << ") has gone or has no carrier: waiting for it";
  if (waited && !choice_->waits() && !next)
    log::info("dds") << "interface " << used.name << " (" << used.address << ") is back";
  return next;
}

void DdsParticipant::move_to(const NetworkInterface& interface) {
  const DdsConfig config = domain_->config();
  const NetworkInterface former = this->interface();
  const bool is_same = former.name == interface.name && former.address == interface.address;
  ++moves_;
  participant_ = {};
  domain_.reset();
  try {
    check_hosts(config.peers);
  } catch (const ConfigError& error) {
    log::warn("dds") << error.what();
  }
  try {
    domain_ = std::make_shared<const DdsDomain>(config, interface);
    join();
    log::info("dds") << (is_same ? "new participant on" : "moved to") << " interface "
                     << interface.name << " (" << interface.address << ')';
  } catch (const DdsError& error) {
    log::warn("dds") << error.what() << ": trying again";
    domain_.reset();
    domain_ =
        std::make_shared<const DdsDomain>(config, select_interface(network_interfaces(), "lo"));
    join();
  }
  choice_->moved_to(this->interface());
}

}  // namespace km
