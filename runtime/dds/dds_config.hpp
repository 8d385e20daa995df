#pragma once

#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// Highest domain below the ports that Linux assigns to any program (net.ipv4.ip_local_port_range,
/// 32768 to 60999). A robot cannot join a domain while a program uses one of the domain's ports.
inline constexpr unsigned kLastQuietDomain = 100;

/// Limits on the bytes that a robot sends. Counted are the bytes of messages as in traffic.csv:
/// once per addressee, and once more for each retransmission. 0: no limit. See SendSchedule.
struct BudgetConfig {
  static constexpr const char* kSection = "budget";

  double bytes_per_s = 0.0;
  double bytes_per_run = 0.0;

  [[nodiscard]] bool is_limited() const { return bytes_per_s > 0.0 || bytes_per_run > 0.0; }

  void visit_fields(auto& visitor) {
    visitor.field(
        "bytes_per_s", bytes_per_s, {0.0, 1e12},
        "[B/s] that this robot sends, including each receiver and retransmissions; further "
        "messages wait, in this order of priority: closures, verification, poses, new words, older "
        "words, mesh; statuses are counted but never wait; 0: no limit");
    visitor.field("bytes_per_run", bytes_per_run, {0.0, 1e15},
                  "[B] in the whole run: the mesh may use the first 60 %, words 80 %, verification "
                  "90 %, poses 95 %, closures all of them; 0: no limit");
  }
};

/// How robots find each other: by multicast on the link, or by a list of addresses.
enum class Discovery { kMulticast, kPeers };

/// The link between robots. Shipped profiles: config/qos/{wired,wifi,intermittent}.yaml.
struct DdsConfig {
  static constexpr const char* kSection = "dds";

  int domain = 0;
  std::string team = "kimera-multi";
  std::string interface;
  Discovery discovery = Discovery::kMulticast;
  std::vector<std::string> peers;
  int max_participant_index = 39;
  int robots_per_peer = 12;
  double lease_s = 60.0;
  double spdp_interval_s = 2.0;
  double liveliness_s = 2.0;
  int max_message_bytes = 65500;
  int fragment_bytes = 8000;
  int max_rexmit_bytes = 1048576;
  int max_init_transmit_percent = -1;
  double nack_delay_ms = 100.0;
  int receive_buffer_bytes = 4194304;

  void visit_fields(auto& visitor) {
    visitor.field("domain", domain, {0, 230},
                  "only robots of one DDS domain meet; ports start at 7400 + 250 * domain: above "
                  "100 they may be in use by other programs");
    visitor.field("team", team, "robots of other teams are ignored");
    visitor.field("interface", interface,
                  "network interface; empty: chosen automatically, see the log");
    visitor.field(
        "discovery", discovery,
        {{"multicast", Discovery::kMulticast}, {"peers", Discovery::kPeers}},
        "how robots find each other: by multicast on the link, or by a list of addresses");
    visitor.field("peers", peers,
                  "addresses (or address:port) of the other hosts; this one is always included");
    visitor.field("max_participant_index", max_participant_index, {0, 110},
                  "robots on this host less one, where they are found by address");
    visitor.field("robots_per_peer", robots_per_peer, {1, 111},
                  "robots looked for at each peer; each costs 0.25 kB per 2 s on the air");
    visitor.field("lease_s", lease_s, {3.0, 3600.0},
                  "[s] silence after which a robot is removed: longer than ordinary outages; "
                  "requests are kept, and robots at their end wait for it, equally long");
    visitor.field("spdp_interval_s", spdp_interval_s, {0.1, 60.0}, "[s] between announcements");
    visitor.field("liveliness_s", liveliness_s, {0.2, 60.0},
                  "[s] silence after which a peer counts as lost");
    visitor.field("max_message_bytes", max_message_bytes, {1200, 65500},
                  "[B] maximum size of a UDP datagram; never more than fits into a packet of the "
                  "interface");
    visitor.field("fragment_bytes", fragment_bytes, {1000, 65000},
                  "[B] larger samples are sent in fragments of this; below max_message_bytes");
    visitor.field("max_rexmit_bytes", max_rexmit_bytes, {1024, 1 << 26},
                  "[B] retransmitted in one burst");
    visitor.field("max_init_transmit_percent", max_init_transmit_percent, {-1, 1000},
                  "first burst of a large sample, of max_rexmit_bytes; -1: unlimited");
    visitor.field("nack_delay_ms", nack_delay_ms, {1.0, 5000.0},
                  "[ms] a receiver waits before it asks again");
    visitor.field("receive_buffer_bytes", receive_buffer_bytes, {65536, 1 << 28},
                  "[B] at most; the kernel may grant less, see net.core.rmem_max");
  }
};

}  // namespace km
