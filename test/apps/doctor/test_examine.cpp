#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "apps/doctor/examine.hpp"
#include "apps/doctor/network_facts.hpp"
#include "apps/robot/run_findings.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/diagnosis/finding.hpp"
#include "test/support/process.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr const char* kImage = "sensor_msgs/msg/Image";
constexpr const char* kImu = "sensor_msgs/msg/Imu";

Finding the_finding(const Examination& result) {
  REQUIRE(result.findings.size() == 1);
  return result.findings[0];
}

// The ids in `text` by a pattern of their two parts. A first part that is empty is that of the id
// before.
std::set<std::string> ids_in(const std::string& text, const char* pattern) {
  const std::regex id(pattern);
  std::set<std::string> ids;
  std::string first;
  for (std::sregex_iterator at(text.begin(), text.end(), id), end; at != end; ++at) {
    if ((*at)[1].length() > 0) first = (*at)[1];
    ids.insert(first + '.' + (*at)[2].str());
  }
  return ids;
}

}  // namespace

TEST_CASE("The doctor's README lists the ids of all findings") {
  const auto listed = ids_in(read_input_file("apps/doctor/README.md"), R"(`([a-z]*)\.([a-z_]+)`)");
  for (const char* file :
       {"apps/robot/run_findings.cpp", "apps/doctor/network_facts.cpp",
        "modules/diagnosis/examine_sensors.cpp", "modules/sensors/usual_numbers.cpp"})
    for (const std::string& id : ids_in(read_input_file(file), R"re("([a-z]+)\.([a-z_]+)")re")) {
      CAPTURE(file, id);
      CHECK((listed.contains(id) || id.starts_with("vio.") || id == "recording.missing_images"));
    }
}

TEST_CASE("Live topics that are received are sound") {
  const std::vector<TopicPublisher> publishers = {{"/left", kImage}, {"/imu", kImu}};
  const auto result =
      examine_topics({{"/left", kImage, 60}, {"/imu", kImu, 600}}, publishers, 3.0, 0);
  CHECK(result.findings.empty());
  CHECK_THAT(to_text(result.figures), Contains("60 messages of sensor_msgs/msg/Image in 3.0"));
}

TEST_CASE("The reason why a live topic is silent follows from the publishers") {
  const std::vector<ListenedTopic> wanted = {{"/left", kImage, 0}};
  const auto why = [&](const std::vector<TopicPublisher>& publishers) {
    return the_finding(examine_topics(wanted, publishers, 3.0, 0));
  };
  CHECK(why({{"/imu", kImu}}).id == "live.silent");
  CHECK_THAT(why({{"/imu", kImu}}).what, Contains("no program publishes it"));
  CHECK_THAT(why({{"/left", kImage}}).what, Contains("a program publishes it, but no message"));
  CHECK(why({{"/left", "sensor_msgs/msg/CompressedImage"}}).id == "live.other_type");
  CHECK(why({{"/cam/left", "sensor_msgs/Image"}}).id == "live.similar_name");
  const auto begins_most_alike = why({{"/cam/left", kImage}, {"/left/image", kImage}});
  CHECK_THAT(begins_most_alike.what, Contains("but one publishes /left/image (sensor_msgs"));
  const auto compressed = why({{"/left/compressed", "sensor_msgs/msg/CompressedImage"}});
  CHECK(compressed.id == "live.similar_name");
  CHECK_THAT(compressed.what, Contains("/left/compressed (sensor_msgs/msg/CompressedImage)"));
  // A topic that another camera already uses is not proposed.
  const auto result = examine_topics({{"/cam0", kImage, 60}, {"/cam2", kImage, 0}},
                                     {{"/cam0", kImage}, {"/other1", kImage}}, 3.0, 0);
  CHECK_THAT(the_finding(result).what, Contains("but one publishes /other1 "));
}

TEST_CASE("If there is no publisher at all, one finding reports it, whatever topics are missing") {
  const auto result = examine_topics({{"/left", kImage, 0}, {"/imu", kImu, 0}}, {}, 3.0, 7);
  REQUIRE(result.findings.size() == 1);
  CHECK(result.figures.size() == 2);
  CHECK(result.findings[0].id == "live.no_publishers");
  CHECK_THAT(result.findings[0].what, Contains("domain 7"));
}

namespace {

constexpr const char* kHeader =
    "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,tx,ty,tz,qx,qy,"
    "qz,qw,sigma_rx,sigma_ry,sigma_rz,sigma_tx,sigma_ty,sigma_tz,reason\n";

// Results of alice (0) and bob (1), who are not in one frame.
class Results {
 public:
  Results() {
    for (const RobotId robot : {RobotId{0}, RobotId{1}}) {
      RunSummary summary;
      summary.robot = robot;
      summary.name = robot == 0 ? "alice" : "bob";
      summary.frames = 500;
      summary.pgo.members = {robot};
      summary.exit_reason = "settled";
      write(robot, summary);
      folder.write(summary.name + "/config.yaml", "pcm:\n  selection: pcm\n  min_inliers: 4\n");
      folder.write(summary.name + "/loop_closures.csv", kHeader);
    }
  }
  void write(RobotId robot, const RunSummary& summary) const {
    folder.write(std::string(robot == 0 ? "alice" : "bob") + "/summary.json", json_text(summary));
  }

  TemporaryFolder folder;
};

const char* const kMeasured = "verified,60,39,1,2,3,0,0,0,1,1,1,1,1,1,1,";

}  // namespace

TEST_CASE("The doctor gives the reason why robots did not join, from all files") {
  const Results results;
  results.folder.write(
      "alice/loop_closures.csv",
      std::string(kHeader) +
          "0,1,1,2,0.5,received,40,0,,,,,,,,,,,,,,,,,,,,\"matches do not agree, on a pose\"\n" +
          "0,3,1,4,0.5," + kMeasured + "\"rejected: the other closures contradict it\"\n" +
          "0,5,1,6,0.5,inlier,60,39,1,2,3,0,0,0,1,1,1,1,1,1,1,\"\"\n");
  results.folder.write(
      "bob/loop_closures.csv",
      std::string(kHeader) + "0,7,1,8,0.5,candidate,0,0,,,,,,,,,,,,,,\"not requested\"\n");
  CHECK(are_results(results.folder.path()));
  const Examination result = examine_results(results.folder.path());
  CHECK_THAT(to_text(result.findings),
             Contains("alice and bob did not join: 4 candidates, 2 verified (see "
                      "loop_closures.csv), 1 kept: below pcm.min_inliers 4"));
  CHECK(has(result, "closures.rejected"));
  CHECK(exit_code_of(result.findings) == 1);
}

TEST_CASE("The findings on a single robot are those of its end") {
  const Results results;
  RunSummary summary = read_summary(results.folder.path() / "alice/summary.json");
  summary.findings = {failed_run("vio: no memory"), {.id = "team.not_joined", .what = "x"}};
  results.write(0, summary);
  const Examination result = examine_results(results.folder.path() / "alice");
  CHECK(result.findings.size() == 2);
  CHECK(result.findings[0].id == "run.failed");
  CHECK(exit_code_of(result.findings) == 2);
}

TEST_CASE("The folder of a robot that was killed is no recording, and the message names --resume") {
  const Results results;
  const auto bob = results.folder.path() / "bob";
  fs::remove(bob / "summary.json");
  results.folder.write("bob/run.journal", "");
  for (const auto& folder : {bob, results.folder.path()}) {
    CAPTURE(folder);
    REQUIRE(are_results(folder));
    const Examination result = examine_results(folder);
    const auto found = std::ranges::find(result.findings, "run.unfinished", &Finding::id);
    REQUIRE(found != result.findings.end());
    CHECK_THAT(found->to_do, Contains("--resume " + bob.string()));
    CHECK(exit_code_of(result.findings) == 1);
  }
}

TEST_CASE("Results with files that are missing or broken are examined as far as possible") {
  const Results results;
  fs::remove(results.folder.path() / "alice/config.yaml");
  results.folder.write("bob/loop_closures.csv", std::string(kHeader) + "0,1\n");
  const Examination result = examine_results(results.folder.path());
  CHECK(has(result, "results.config"));
  CHECK(has(result, "results.loop_closures"));
  CHECK(has(result, "team.not_joined"));
  results.folder.write("bob/summary.json", "{");
  CHECK_THROWS_WITH(examine_results(results.folder.path()), Contains("bob/summary.json"));
  CHECK_FALSE(are_results(results.folder.path() / "nowhere"));
}

namespace {

const NetworkInterface kEthernet{
    .name = "eth0", .address = "10.0.0.1", .multicast = true, .loopback = false, .mtu = 1500};

DiscoveredRobot robot(RobotId id, const std::string& name) {
  return {.address = "udp/10.0.0.2:7411",
          .identity = RobotIdentity{.robot = id, .name = name, .boot = 0x10000U + id}};
}

// A sound host, with another robot of the team in reach.
NetworkFacts sound() {
  NetworkFacts facts;
  facts.config.domain = 42;
  facts.interfaces = {kEthernet};
  facts.chosen = kEthernet;
  facts.largest_receive_buffer = facts.config.receive_buffer_bytes;
  facts.robots = {robot(3, "carol")};
  facts.listened_s = 5.0;
  return facts;
}

std::string ids_of(const NetworkFacts& facts) {
  std::string ids;
  for (const Finding& finding : examine_network(facts).findings)
    ids += std::string(to_string(finding.severity)) + ' ' + finding.id + ' ';
  return ids;
}

}  // namespace

TEST_CASE("A sound network has no findings") {
  NetworkFacts facts = sound();
  CHECK(ids_of(facts).empty());
  facts.elsewhere = {{{0, "eth0"}, {"10.0.0.9"}}};  // ROS 2, or another team
  facts.echoes = {
      {.host = "10.0.0.2", .sent = 20, .received = 20, .median_s = 2e-3, .worst_s = 9e-3}};
  facts.clocks = {{"alice (id 7)", -0.002}};
  CHECK(ids_of(facts).empty());
}

TEST_CASE("The reason that keeps robots apart on a network is named") {
  struct Case {
    std::string ids;
    std::function<void(NetworkFacts&)> change;
  };
  const auto echo = [](PeerEcho peer) {
    peer.host = "10.0.0.2";
    return [peer](NetworkFacts& facts) {
      facts.config.peers = {peer.host};
      facts.echoes = {peer};
    };
  };
  const Case c = GENERATE_COPY(
      Case{"error network.interface ", [](auto& facts) { facts.chosen.reset(); }},
      Case{"warning network.several_interfaces ",
           [](auto& facts) {
             facts.interfaces.push_back({"wlan0", "10.1.0.1", true, false});
           }},
      Case{"note network.several_interfaces ",
           [](auto& facts) {
             facts.interfaces.push_back({"docker0", "172.17.0.1", true, false, 0, false});
           }},
      Case{"error network.no_carrier ", [](auto& facts) { facts.chosen->carrier = false; }},
      Case{"warning network.other_interface ",
           [](auto& facts) {
             facts.elsewhere = {{{42, "wlan0"}, {"10.1.0.2"}}};
           }},
      Case{"error network.keys ",
           [](auto& facts) {
             facts.robots.push_back(robot(7, "alice"));
             facts.robots.back().has_keys = true;
           }},
      Case{"error network.one_sided ", [](auto& facts) { facts.robots[0].unanswered_s = 4.0; }},
      Case{"error network.path_mtu ", echo({.host = {},
                                            .sent = 20,
                                            .received = 20,
                                            .packet_bytes = 1500,
                                            .passing_bytes = 1280})},
      Case{"",
           [](auto& facts) {
             facts.interfaces.push_back({"wlan0", "10.1.0.1", true, false});
             facts.config.interface = "eth0";
           }},
      Case{"error network.multicast ", [](auto& facts) { facts.no_multicast = "lost"; }},
      Case{"",
           [](auto& facts) {
             facts.no_multicast = "lost";
             facts.config.discovery = Discovery::kPeers;  // it is not needed
           }},
      Case{"error network.firewall ", [](auto& facts) { facts.no_unicast = "lost"; }},
      Case{"warning network.buffers ", [](auto& facts) { facts.largest_receive_buffer = 65536; }},
      Case{"note network.buffers ",  // Linux' usual: it works
           [](auto& facts) { facts.largest_receive_buffer = 212992; }},
      Case{"warning network.mtu ", [](auto& facts) { facts.chosen->mtu = 576; }},
      Case{"error network.protocol ",
           [](auto& facts) { facts.robots[0].identity->protocol = kProtocolVersion + 1; }},
      Case{"error network.protocol ", [](auto& facts) { facts.robots[0].identity.reset(); }},
      Case{"",  // one process, received twice
           [](auto& facts) {
             facts.robots = {robot(7, "alice"), robot(7, "alice")};
           }},
      Case{"error network.same_id ",
           [](auto& facts) {
             facts.robots = {robot(7, "alice"), robot(7, "bob")};
             facts.robots[1].identity->boot = 0x50000;
           }},
      Case{"error network.keys ",  // and these two ignore each other
           [](auto& facts) {
             facts.robots = {robot(7, "alice"), robot(7, "bob")};
             facts.robots[1].identity->boot = 0x50000;
             facts.robots[1].has_keys = true;
           }},
      Case{"note network.other_programs ", [](auto& facts) { facts.ros_topics = 3; }},
      Case{"warning network.unreachable ", echo({.host = {}, .sent = 20})},
      Case{"warning network.loss ", echo({.host = {}, .sent = 20, .received = 15})},
      Case{"warning network.slow ",
           echo({.host = {}, .sent = 20, .received = 20, .median_s = 0.4})},
      Case{"", echo({.host = {}, .may_send_icmp = false})},
      Case{"warning network.no_peers ",
           [](auto& facts) {
             facts.config.peers = {"10.0.0.2"};
             facts.robots.clear();
           }},
      Case{"warning network.no_peers ",  // as behind NAT: this host's own robot is received
           [](auto& facts) {
             facts.config.peers = {"10.0.0.2"};
             facts.robots[0].address = "udp/" + facts.chosen->address + ":7411@2";
           }},
      Case{"note network.no_peers ", [](auto& facts) { facts.robots.clear(); }},
      Case{"warning network.other_domain note network.no_peers ",
           [](auto& facts) {
             facts.robots.clear();
             facts.elsewhere = {{{43, "eth0"}, {"10.0.0.2", "10.0.0.3"}}};
           }},
      Case{"note network.clock ", [](auto& facts) {
             facts.clocks = {{"alice", 3600.0}};
           }});
  CAPTURE(c.ids);
  NetworkFacts facts = sound();
  c.change(facts);
  CHECK(ids_of(facts) == c.ids);
}

TEST_CASE("On loopback alone the finding depends on whether the host has another interface") {
  NetworkFacts facts = sound();
  facts.chosen = NetworkInterface{"lo", "127.0.0.1", true, true};
  facts.config.interface = "lo";
  CHECK_THAT(examine_network(facts).findings.at(0).what, Equals("lo is loopback"));
  facts.interfaces = {*facts.chosen};
  CHECK_THAT(examine_network(facts).findings.at(0).what, Equals("only loopback is up"));
}

TEST_CASE("The doctor finds a robot on its domain, and its address on another one") {
  std::random_device device;
  DdsConfig config{.domain = static_cast<int>(device() % 90),
                   .team = "test-" + std::to_string(device()),
                   .interface = "lo",
                   .peers = {}};
  const Process peer({KM_BIN_DIR "/test_dds_peer", "7", "", "dds.team=" + config.team,
                      "dds.domain=" + std::to_string(config.domain), "dds.interface=lo",
                      "dds.spdp_interval_s=0.2"});
  const std::string found = GENERATE("(id 7)", "warning network.other_domain");
  if (found != "(id 7)") ++config.domain;
  const auto text = [&] {
    const NetworkFacts facts = probe_network(config, 0.5, [](std::string_view, double) {});
    return ids_of(facts) + to_text(examine_network(facts).figures);
  };
  std::string last;
  for (int tries = 0; tries < 20 && last.find(found) == last.npos; ++tries) last = text();
  CHECK_THAT(last, Contains(found));
}

}  // namespace km
