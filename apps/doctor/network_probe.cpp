#include <envelope.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <set>
#include <system_error>

#include "apps/doctor/network_facts.hpp"
#include "apps/robot/datagram_socket.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/entity.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/qos.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/ros/ros_discovery.hpp"

namespace km {
namespace {

using std::chrono::milliseconds;

constexpr const char* kGroup = "239.255.0.1";  // group of DDS discovery (RTPS 2.5, Sec. 9.6.1.4)
constexpr milliseconds kPatience{500};
constexpr std::size_t kEchoes = 20;

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

// Reason why a datagram to `address` did not come back; nullopt if it did. Other datagrams are
// ignored.
std::optional<std::string> echo_to(DatagramSocket& socket, const std::string& address) {
  const std::vector<std::uint8_t> bytes = DatagramSocket::own_bytes();
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
    if (!socket.receive_own_groups_only()) return;
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
    facts.echoes.push_back(ask_peer(peer, largest_datagram(config, *facts.chosen) + 28, kEchoes));
  }
  listen(config, listen_s, report_progress, facts);
  return facts;
}

}  // namespace km
