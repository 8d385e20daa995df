#include <arpa/inet.h>
#include <envelope.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <system_error>

#include "apps/descriptor.hpp"
#include "apps/doctor/network_facts.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/text_rows.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/entity.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/qos.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/dds/ros_discovery.hpp"

namespace km {
namespace {

using std::chrono::milliseconds;

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

// A received datagram.
struct Datagram {
  std::string from;  // address, dotted
  std::vector<std::uint8_t> bytes;
};

// An IPv4 socket for datagrams: UDP, or ICMP echoes.
class DatagramSocket {
 public:
  // UDP on `port` (0: any) of all addresses, shared with other programs that listen there. Throws
  // std::system_error.
  [[nodiscard]] static DatagramSocket udp(std::uint16_t port) {
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

  // Socket for ICMP echoes; nullopt if this user has no permission.
  [[nodiscard]] static std::optional<DatagramSocket> icmp() {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, IPPROTO_ICMP);
    if (socket >= 0) return DatagramSocket(socket);
    const int raw = ::socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC, IPPROTO_ICMP);
    if (raw >= 0) return DatagramSocket(raw, true);
    return std::nullopt;
  }

  [[nodiscard]] int handle() const { return socket_.get(); }
  [[nodiscard]] std::uint16_t port() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    getsockname(handle(), reinterpret_cast<sockaddr*>(&own), &size);
    return ntohs(own.sin_port);
  }

  // Joins `group` on the interface with this address. The socket then receives datagrams of the
  // group, also its own, and sends to the group through this interface. Returns the reason if this
  // fails.
  [[nodiscard]] std::optional<std::string> join(const std::string& group,
                                                const std::string& interface_address) {
    ip_mreq request{};
    request.imr_multiaddr = parsed(group);
    request.imr_interface = parsed(interface_address);
    const bool joined = set_option(handle(), IPPROTO_IP, IP_ADD_MEMBERSHIP, request) &&
                        set_option(handle(), IPPROTO_IP, IP_MULTICAST_IF, request.imr_interface) &&
                        set_option(handle(), IPPROTO_IP, IP_MULTICAST_LOOP, 1);
    return joined ? std::nullopt : std::optional("cannot join " + group + ": " + last_error());
  }

  // Sends a datagram. Returns the reason if this fails.
  [[nodiscard]] std::optional<std::string> send(const std::string& address, std::uint16_t port,
                                                const std::vector<std::uint8_t>& bytes) {
    const sockaddr_in to = address_with(parsed(address), port);
    const auto sent = sendto(handle(), bytes.data(), bytes.size(), 0,
                             reinterpret_cast<const sockaddr*>(&to), sizeof to);
    return sent >= 0 ? std::nullopt : std::optional("cannot send: " + last_error());
  }

  // The next datagram; nullopt if none arrives within `patience`.
  [[nodiscard]] std::optional<Datagram> receive(std::chrono::milliseconds patience) {
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
      bytes.erase(bytes.begin(), bytes.begin() + std::min(std::ptrdiff_t(bytes.size()),
                                                          std::ptrdiff_t(4 * words)));
    }
    return Datagram{dotted(from.sin_addr), std::move(bytes)};
  }

 private:
  explicit DatagramSocket(int socket, bool has_ip_header = false)
      : socket_(socket), has_ip_header_(has_ip_header) {}

  Descriptor socket_;
  bool has_ip_header_;  // true if received bytes begin with an IP header
};

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
  return dotted(address);
}

constexpr const char* kGroup = "239.255.0.1";  // group of DDS discovery (RTPS 2.5, Sec. 9.6.1.4)
constexpr milliseconds kPatience{500};

std::uint16_t discovery_port(int domain) {
  return static_cast<std::uint16_t>(7400 + 250 * domain);
}

std::optional<long> largest_receive_buffer() {
  try {
    const std::string text = read_input_file("/proc/sys/net/core/rmem_max");
    const auto bytes = parse_int64(std::string_view(text).substr(0, text.find('\n')));
    return bytes ? std::optional(static_cast<long>(*bytes)) : std::nullopt;
  } catch (const InputFileError&) {  // the file does not exist in some containers
    return std::nullopt;
  }
}

// Random bytes that no other program sends, and that DDS drops as invalid, with zeros up to `size`.
std::vector<std::uint8_t> own_bytes(std::size_t size = 16) {
  std::vector<std::uint8_t> bytes = {'K', 'M', 'D', 'R'};
  std::random_device device;
  for (int k = 0; k < 12; ++k) bytes.push_back(static_cast<std::uint8_t>(device()));
  bytes.resize(std::max(bytes.size(), size));
  return bytes;
}

// Reason why a datagram to `address` did not come back; nullopt if it did. Other datagrams are
// ignored.
std::optional<std::string> echo_to(DatagramSocket& socket, const std::string& address) {
  const std::vector<std::uint8_t> bytes = own_bytes();
  if (auto problem = socket.send(address, socket.port(), bytes)) return problem;
  const double end_s = steady_now_s() + 1e-3 * static_cast<double>(kPatience.count());
  while (steady_now_s() < end_s)
    if (const auto datagram = socket.receive(milliseconds(50));
        datagram && datagram->bytes == bytes)
      return std::nullopt;
  return "the test datagram was not received in " + std::to_string(kPatience.count()) + " ms";
}

std::optional<std::string> try_multicast(const DdsConfig& config, const NetworkInterface& chosen) {
  if (!chosen.multicast && !chosen.loopback) return chosen.name + " is not capable of multicast";
  DatagramSocket socket = DatagramSocket::udp(discovery_port(config.domain));
  if (auto problem = socket.join(kGroup, chosen.address)) return problem;
  return echo_to(socket, kGroup);
}

std::optional<std::string> try_unicast(const NetworkInterface& chosen) {
  DatagramSocket socket = DatagramSocket::udp(0);
  return echo_to(socket, chosen.address);
}

// Receives multicast announcements of other domains, and those of the own domain on other
// interfaces. Their contents are not read.
class ElsewhereListener {
 public:
  ElsewhereListener(int own_domain, const NetworkFacts& facts) {
    for (int domain = 0; domain <= static_cast<int>(kLastQuietDomain); ++domain)
      if (domain != own_domain) add(domain, *facts.chosen);
    for (const NetworkInterface& interface : facts.interfaces)
      if (interface.name != facts.chosen->name && !interface.loopback) add(own_domain, interface);
  }

  // Adds the addresses of senders.
  void listen(milliseconds patience, std::map<Elsewhere, std::set<std::string>>& senders) {
    std::vector<pollfd> waiting;
    for (const auto& [where, socket] : sockets_)
      waiting.push_back({.fd = socket.handle(), .events = POLLIN, .revents = 0});
    if (poll(waiting.data(), waiting.size(), static_cast<int>(patience.count())) <= 0) return;
    constexpr std::array<std::uint8_t, 4> kRtps = {'R', 'T', 'P', 'S'};  // begins a packet of DDS
    for (std::size_t k = 0; k < sockets_.size(); ++k) {
      if (waiting[k].revents == 0) continue;
      const auto datagram = sockets_[k].second.receive(milliseconds(0));
      if (datagram && std::ranges::mismatch(kRtps, datagram->bytes).in1 == kRtps.end())
        senders[sockets_[k].first].insert(datagram->from);
    }
  }

 private:
  void add(int domain, const NetworkInterface& interface) try {
    DatagramSocket socket = DatagramSocket::udp(discovery_port(domain));
    // Otherwise the socket also receives what comes to groups of other sockets.
    if (!set_option(socket.handle(), IPPROTO_IP, IP_MULTICAST_ALL, 0)) return;
    if (!socket.join(kGroup, interface.address))
      sockets_.emplace_back(Elsewhere{domain, interface.name}, std::move(socket));
  } catch (const std::system_error&) {  // the port belongs to another program
  }

  std::vector<std::pair<Elsewhere, DatagramSocket>> sockets_;
};

// The addresses of a participant, as DDS states them. Untrusted.
std::string addresses_of(const dds_qos_t* qos) {
  char* value = nullptr;
  if (!dds_qget_prop(qos, "__NetworkAddresses", &value) || value == nullptr) return {};
  const std::string result = readable(value, 100);
  dds_free(value);
  return result;
}

// A DDS participant that takes part in discovery only, and that robots ignore.
class DiscoveryObserver {
 public:
  explicit DiscoveryObserver(const DdsConfig& config)
      : domain_(config),
        participant_(
            dds_create_participant(static_cast<dds_domainid_t>(config.domain), nullptr, nullptr),
            "DDS participant"),
        participants_(dds_create_reader(participant_.handle(), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT,
                                        nullptr, nullptr),
                      "reader of the participants"),
        topic_(dds_create_topic(participant_.handle(), &km_wire_Envelope_desc,
                                Codec<RobotStatus>::kTopic, nullptr, nullptr),
               "topic of statuses"),
        statuses_(dds_create_reader(participant_.handle(), topic_.handle(),
                                    make_reader_qos(TopicKind::kStatus, config).get(), nullptr),
                  "reader of statuses") {}

  // Adds the robots that DDS has discovered since the last call. Participants that do not claim to
  // be robots are ignored: the doctor itself, and other programs.
  void take(std::vector<DiscoveredRobot>& robots) {
    for_each(participants_, [&](const dds_sample_info_t& info, const void* sample) {
      const auto& found = *static_cast<const dds_builtintopic_participant_t*>(sample);
      if (!info.valid_data) return;
      const std::string user_data = user_data_of(found.qos);
      if (!claims_to_be_a_robot(user_data)) return;
      DiscoveredRobot& robot = robots.emplace_back();
      robot.address = addresses_of(found.qos);
      heard_.push_back({info.instance_handle, steady_now_s()});
      if (const auto announcement = parse_user_data(user_data).value) {
        robot.identity = announcement->identity;
        robot.has_keys = !announcement->credentials.empty();
        of_participant_[info.instance_handle] = to_string(*robot.identity);
      }
    });
  }

  // States for how long robots have been heard without an answer. `robots`: all that take() added.
  void note_silence(std::vector<DiscoveredRobot>& robots) const {
    std::vector<dds_instance_handle_t> writers(1024);
    const dds_return_t count =
        dds_get_matched_publications(statuses_.handle(), writers.data(), writers.size());
    writers.resize(static_cast<std::size_t>(std::clamp(count, 0, 1024)));
    std::set<dds_instance_handle_t> answering;
    for (const dds_instance_handle_t writer : writers) answering.insert(participant_of(writer));
    for (std::size_t k = 0; k < robots.size(); ++k)
      robots[k].unanswered_s =
          answering.contains(heard_[k].participant) ? 0.0 : steady_now_s() - heard_[k].since_s;
  }

  // For each writer of statuses, keeps the least offset of its stamps from the clock of this host.
  void take_clocks() {
    const double now_s = wall_now_s();
    for_each(statuses_, [&](const dds_sample_info_t& info, const void* /*sample*/) {
      if (!info.valid_data) return;
      const double ahead_s = 1e-9 * static_cast<double>(info.source_timestamp) - now_s;
      const auto [known, is_new] = ahead_s_.try_emplace(info.publication_handle, ahead_s);
      if (!is_new) known->second = std::max(known->second, ahead_s);
    });
  }

  [[nodiscard]] std::vector<ClockDifference> clocks() const {
    std::vector<ClockDifference> clocks;
    for (const auto& [writer, ahead_s] : ahead_s_) clocks.push_back({name_of(writer), ahead_s});
    return clocks;
  }

 private:
  static void for_each(const DdsEntity& reader, const auto& use) {
    constexpr std::size_t kAtOnce = 16;
    std::array<void*, kAtOnce> samples{};
    std::array<dds_sample_info_t, kAtOnce> infos{};
    for (std::size_t count = kAtOnce; count == kAtOnce;) {
      count = static_cast<std::size_t>(
          check_dds(dds_take(reader.handle(), samples.data(), infos.data(), kAtOnce, kAtOnce),
                    "cannot take messages"));
      for (std::size_t k = 0; k < count; ++k) use(infos[k], samples[k]);
      dds_return_loan(reader.handle(), samples.data(), static_cast<std::int32_t>(count));
      samples = {};
    }
  }

  [[nodiscard]] std::string name_of(dds_instance_handle_t writer) const {
    const auto participant = of_participant_.find(participant_of(writer));
    return participant != of_participant_.end() ? participant->second : "a robot";
  }

  // DDS_HANDLE_NIL if it is gone.
  [[nodiscard]] dds_instance_handle_t participant_of(dds_instance_handle_t writer) const {
    dds_builtintopic_endpoint_t* const endpoint =
        dds_get_matched_publication_data(statuses_.handle(), writer);
    if (endpoint == nullptr) return DDS_HANDLE_NIL;
    const dds_instance_handle_t participant = endpoint->participant_instance_handle;
    dds_builtintopic_free_endpoint(endpoint);
    return participant;
  }

  DdsDomain domain_;
  DdsEntity participant_, participants_, topic_, statuses_;
  struct Heard {
    dds_instance_handle_t participant = DDS_HANDLE_NIL;
    double since_s = 0.0;
  };
  std::vector<Heard> heard_;  // in the order of take()
  std::map<dds_instance_handle_t, std::string> of_participant_;
  std::map<dds_instance_handle_t, double> ahead_s_;
};

constexpr std::size_t kEchoes = 20;
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
    const auto answer = socket.receive(milliseconds(100));
    if (answer && is_echo(answer->bytes, data)) return steady_now_s() - start_s;
  }
  return std::nullopt;
}

// The largest packet that passes [B], if one of `packet_bytes` does not.
int largest_passing(DatagramSocket& socket, const std::string& address, int packet_bytes) {
  constexpr int kHeaders_bytes = 20 + 8, kTries = 3, kStep_bytes = 4;
  const auto passes = [&](int bytes) {
    for (int k = 0; k < kTries; ++k)
      if (echo_s(socket, address, own_bytes(static_cast<std::size_t>(bytes - kHeaders_bytes))))
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

// Sends echo requests one after the other, and waits for each reply. `packet_bytes`: the largest
// packet that robots send.
PeerEcho ask(const std::string& host, int packet_bytes) {
  PeerEcho echo{.host = host,
                .median_s = std::numeric_limits<double>::quiet_NaN(),
                .worst_s = std::numeric_limits<double>::quiet_NaN()};
  const auto address = address_of(host);
  auto socket = DatagramSocket::icmp();
  echo.may_send_icmp = socket.has_value();
  if (!socket || !address) return echo;
  std::vector<double> times_s;
  const auto is_silent = [&] { return times_s.empty() && echo.sent >= kEchoesUnanswered; };
  for (; echo.sent < kEchoes && !is_silent(); ++echo.sent)
    if (const auto time_s = echo_s(*socket, *address, own_bytes())) times_s.push_back(*time_s);
  echo.received = times_s.size();
  if (times_s.empty()) return echo;
  std::ranges::sort(times_s);
  echo.median_s = times_s[times_s.size() / 2];
  echo.worst_s = times_s.back();
  echo.packet_bytes = packet_bytes / 2 * 2;
  echo.passing_bytes = largest_passing(*socket, *address, echo.packet_bytes);
  return echo;
}

void listen(const DdsConfig& config, double listen_s, const ReportProgress& report_progress,
            NetworkFacts& facts) {
  ElsewhereListener elsewhere(config.domain, facts);
  DiscoveryObserver observer(config);
  const RosNetwork ros({.domain = config.domain, .interface = facts.chosen->name});
  RosDiscovery ros_topics(ros);
  const double start_s = steady_now_s();
  while (steady_now_s() - start_s < listen_s) {
    report_progress("listening", (steady_now_s() - start_s) / listen_s);
    elsewhere.listen(milliseconds(20), facts.elsewhere);
    observer.take(facts.robots);
    observer.take_clocks();
  }
  observer.note_silence(facts.robots);
  facts.listened_s = listen_s;
  std::set<std::string> topics;
  for (const TopicPublisher& publisher : ros_topics.publishers()) topics.insert(publisher.topic);
  facts.ros_topics = topics.size();
  facts.clocks = observer.clocks();
}

}  // namespace

NetworkFacts probe_network(const DdsConfig& config, double listen_s,
                           const ReportProgress& report_progress) {
  NetworkFacts facts{.config = checked(config), .interfaces = network_interfaces(config.peers)};
  try {
    facts.chosen = select_interface(facts.interfaces, config.interface);
  } catch (const ConfigError& error) {
    facts.no_interface = error.what();
    return facts;
  }
  facts.largest_receive_buffer = largest_receive_buffer();
  facts.no_multicast = try_multicast(config, *facts.chosen);
  facts.no_unicast = try_unicast(*facts.chosen);
  for (const std::string& peer : config.peers) {
    report_progress("asking " + peer, 0.0);
    facts.echoes.push_back(ask(peer, largest_datagram(config, *facts.chosen) + 28));
  }
  listen(config, listen_s, report_progress, facts);
  return facts;
}

}  // namespace km
