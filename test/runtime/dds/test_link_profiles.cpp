#include <netdb.h>

#include "runtime/config_layers.hpp"
#include "runtime/dds/participant.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const NetworkInterface kLoopback{"lo", "127.0.0.1", false, true};
const NetworkInterface kCable{"eth0", "10.0.0.1", true, false};
const NetworkInterface kRadio{"wlan0", "10.1.0.1", true, false};
const NetworkInterface kTunnel{"tun0", "10.2.0.1", false, false};

DdsConfig profile(const std::string& name, const std::vector<std::string>& overrides) {
  ConfigLayers layers;
  layers.add_file("config/qos/" + name + ".yaml");
  for (const std::string& o : overrides) layers.add_override(o);
  const auto config = layers.load<DdsConfig>();
  layers.finish();
  return config;
}

TEST_CASE("Every shipped profile gives a participant, by multicast and by peers") {
  const std::string name = GENERATE("wired", "wifi", "intermittent");
  const std::string discovery = GENERATE("multicast", "peers");
  CAPTURE(name, discovery);
  const DdsConfig test = loopback_config();
  const DdsConfig config = profile(
      name, {"dds.discovery=" + discovery, "dds.peers=[127.0.0.1, 127.0.0.2]", "dds.interface=lo",
             "dds.domain=" + std::to_string(test.domain), "dds.team=" + test.team});
  CHECK_NOTHROW(DdsParticipant(config, {1, "a", kProtocolVersion, 1}));
}

TEST_CASE("The profiles leave room for more than ten robots on one host") {
  const std::string name = GENERATE("wired", "wifi", "intermittent");
  CHECK(profile(name, {}).max_participant_index >= 32);
  // Ports of the last one stay below those of the next domain and inside 16 bits.
  CHECK(11 + 2 * profile(name, {}).max_participant_index < 250);
}

TEST_CASE("The wired profile is the default configuration") {
  CHECK(to_yaml(profile("wired", {})) == to_yaml(DdsConfig{}));
}

TEST_CASE("Found by address a robot takes a fixed port, by multicast any") {
  DdsConfig config;
  CHECK_THAT(cyclone_xml(config, kCable), Contains("<ParticipantIndex>none<") &&
                                              Contains("<AllowMulticast>spdp<") &&
                                              !Contains("<Peers>"));
  config.discovery = Discovery::kPeers;
  config.peers = {"10.0.0.2", "10.0.0.1", "10.0.0.3:9999"};
  config.domain = 2;
  config.robots_per_peer = 2;
  CHECK_THAT(
      cyclone_xml(config, kCable),
      Contains("<ParticipantIndex>auto<") && Contains("<AllowMulticast>false<") &&
          Contains("<Peers><Peer address='10.0.0.1'/><Peer address='10.0.0.2:7910'/>"
                   "<Peer address='10.0.0.2:7912'/><Peer address='10.0.0.3:9999'/></Peers>"));
}

TEST_CASE("The loopback interface is configured to carry multicast") {
  const DdsConfig config;
  CHECK_THAT(cyclone_xml(config, kLoopback), Contains("name='lo' multicast='true'"));
  CHECK_THAT(cyclone_xml(config, kCable), !Contains("multicast='true'"));
}

TEST_CASE("Text of a configuration cannot break out of the XML document") {
  DdsConfig config;
  config.team = "a</Tag><evil b='\"&";
  CHECK_THAT(cyclone_xml(config, kCable),
             Contains("<Tag>a&lt;/Tag&gt;&lt;evil b=&apos;&quot;&amp;</Tag>"));
}

TEST_CASE("Datagrams, also repeated ones and fragments, fit into packets of the interface") {
  NetworkInterface tunnel = kTunnel;
  tunnel.mtu = 1280;
  CHECK_THAT(cyclone_xml(profile(GENERATE("wired", "wifi"), {}), tunnel),
             Contains("<MaxMessageSize>1252B<") && Contains("<MaxRexmitMessageSize>1252B<") &&
                 Contains("<FragmentSize>1152B<"));
  CHECK_THAT(cyclone_xml({}, kCable), Contains("<MaxMessageSize>65500B<"));  // MTU unknown
}

TEST_CASE("An interface without a carrier, or away from the peers, is not chosen") {
  NetworkInterface docker{"docker0", "172.17.0.1", true, false};
  NetworkInterface tunnel = kTunnel;
  const auto with = [&](bool has_carrier, int routes) {
    docker.carrier = has_carrier;
    tunnel.routes = routes;
    return std::vector<NetworkInterface>{kLoopback, docker, tunnel};
  };
  CHECK(select_interface(with(true, 0), "").name == "docker0");
  CHECK(others_than(kTunnel, with(true, 0)).reasons == "docker0 is as good");
  CHECK(select_interface(with(false, 0), "").name == "tun0");
  CHECK(others_than(tunnel, with(false, 0)).reasons == "docker0 has no carrier");
  CHECK(select_interface(with(true, 1), "").name == "tun0");
  CHECK(others_than(tunnel, with(true, 1)).reasons ==
        "docker0 is not on the route to other robots");
  CHECK(select_interface({kLoopback, with(false, 0)[1]}, "").name == "lo");
  CHECK(select_interface(with(false, 0), "docker0").name == "docker0");
}

TEST_CASE("The interface is the one named, else the likeliest") {
  CHECK(select_interface({kLoopback, kCable, kRadio}, "wlan0").name == "wlan0");
  CHECK(select_interface({kLoopback, kCable, kRadio}, "").name == "eth0");
  CHECK(select_interface({kLoopback, kTunnel, kRadio}, "").name == "wlan0");
  CHECK(select_interface({kLoopback, kTunnel}, "").name == "tun0");
  CHECK(select_interface({kLoopback}, "").name == "lo");
  CHECK_THROWS_WITH(select_interface({kLoopback, kCable}, "wlan9"),
                    Contains("dds.interface = wlan9") && Contains("eth0 (10.0.0.1)"));
  CHECK_THROWS_AS(select_interface({}, ""), ConfigError);
}

TEST_CASE("Hosts that are unknown are all named") {
  CHECK_NOTHROW(check_hosts({}));
  CHECK_NOTHROW(check_hosts({"10.0.0.2", "127.0.0.1:7410"}));
  if (gethostbyname("localhost") == nullptr)
    WARN("SKIPPED in part: this computer has no name localhost (see /etc/hosts)");
  else
    CHECK_NOTHROW(check_hosts({"localhost"}));
  CHECK_THROWS_WITH(check_hosts({"10.0.0.2", "not an address", "10.0.0.300:7", "10.0.0.3:port"}),
                    Contains("not an address: ") && Contains("10.0.0.300:7: ") &&
                        Contains("10.0.0.3:port: ") && !Contains("10.0.0.2"));
}

}  // namespace
}  // namespace km
