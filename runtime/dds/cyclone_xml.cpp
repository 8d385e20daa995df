#include "runtime/dds/cyclone_xml.hpp"

#include <cmath>
#include <sstream>

#include "modules/core/xml_text.hpp"

namespace km {
namespace {

std::string milliseconds(double seconds) {
  return std::to_string(std::llround(seconds * 1e3)) + "ms";
}

void write_general(std::ostream& xml, const DdsConfig& config, const NetworkInterface& interface) {
  const bool multicast = config.discovery == Discovery::kMulticast;
  xml << "<General><Interfaces><NetworkInterface name='" << xml_escaped(interface.name) << '\'';
  // Linux does not flag loopback as capable of multicast, yet it is.
  if (multicast && interface.loopback) xml << " multicast='true'";
  // Data goes by unicast: on radio, multicast runs at the base rate and without acknowledgement.
  xml << "/></Interfaces><AllowMulticast>" << (multicast ? "spdp" : "false")
      << "</AllowMulticast><MaxMessageSize>" << config.max_message_bytes
      << "B</MaxMessageSize><FragmentSize>" << config.fragment_bytes
      << "B</FragmentSize></General>";
}

// Where the discovery of the robots 0, 1, ... of a host listens: the port mapping of RTPS with its
// default parameters.
int discovery_port(int domain, int index) {
  return 7400 + 250 * domain + 10 + 2 * index;
}

// Robots on this host cost nothing on the network: the whole range is asked. Elsewhere each port
// that is asked is a packet on the air.
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
  // Fixed ports are needed where robots are found by address, and only there: without them any
  // number of robots fits on one host.
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
