#include "runtime/dds/cyclone_xml.hpp"

#include <cmath>
#include <sstream>

namespace km {
namespace {

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '\'':
        result += "&apos;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string milliseconds(double seconds) {
  return std::to_string(std::llround(seconds * 1e3)) + "ms";
}

void write_general(std::ostream& xml, const DdsConfig& config, const NetworkInterface& interface) {
  const bool multicast = config.discovery == Discovery::kMulticast;
  xml << "<General><Interfaces><NetworkInterface name='" << escaped(interface.name) << '\'';
  // Linux does not flag loopback as capable of multicast, yet it is.
  if (multicast && interface.loopback) xml << " multicast='true'";
  // Data goes by unicast: on radio, multicast runs at the base rate and without acknowledgement.
  xml << "/></Interfaces><AllowMulticast>" << (multicast ? "spdp" : "false")
      << "</AllowMulticast><MaxMessageSize>" << config.max_message_bytes
      << "B</MaxMessageSize><FragmentSize>" << config.fragment_bytes
      << "B</FragmentSize></General>";
}

void write_discovery(std::ostream& xml, const DdsConfig& config,
                     const NetworkInterface& interface) {
  const bool by_address = config.discovery == Discovery::kPeers || !config.peers.empty();
  // Fixed ports are needed where robots are found by address, and only there: without them any
  // number of robots fits on one host.
  xml << "<Discovery><ParticipantIndex>" << (by_address ? "auto" : "none")
      << "</ParticipantIndex><MaxAutoParticipantIndex>" << config.max_participant_index
      << "</MaxAutoParticipantIndex><LeaseDuration>" << milliseconds(config.lease_s)
      << "</LeaseDuration><SPDPInterval>" << milliseconds(config.spdp_interval_s)
      << "</SPDPInterval><Tag>" << escaped(config.team) << "</Tag>";
  if (by_address) {
    xml << "<Peers><Peer address='" << interface.address << "'/>";
    for (const std::string& peer : config.peers)
      if (peer != interface.address) xml << "<Peer address='" << escaped(peer) << "'/>";
    xml << "</Peers>";
  }
  xml << "</Discovery>";
}

void write_internal(std::ostream& xml, const DdsConfig& config) {
  xml << "<Internal><SocketReceiveBufferSize max='" << config.receive_buffer_bytes
      << "B'/><BurstSize><MaxRexmit>" << config.max_rexmit_bytes << "B</MaxRexmit>";
  if (config.max_init_transmit_percent >= 0)
    xml << "<MaxInitTransmit>" << config.max_init_transmit_percent << "</MaxInitTransmit>";
  xml << "</BurstSize><NackDelay>" << milliseconds(config.nack_delay_ms * 1e-3) << "</NackDelay>"
      << "<Watermarks><WhcHigh>64MB</WhcHigh><WhcHighInit>64MB</WhcHighInit>"
         "<WhcAdaptive>false</WhcAdaptive></Watermarks></Internal>";
}

}  // namespace

std::string cyclone_xml(const DdsConfig& config, const NetworkInterface& interface) {
  std::ostringstream xml;
  xml << "<CycloneDDS><Domain id='any'>";
  write_general(xml, config, interface);
  write_discovery(xml, config, interface);
  write_internal(xml, config);
  xml << "</Domain></CycloneDDS>";
  return xml.str();
}

}  // namespace km
