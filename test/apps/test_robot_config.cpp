#include <catch2/catch.hpp>

#include <fstream>
#include <iterator>
#include <string>

#include "apps/robot/robot_config.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

// The text of section `name`, from its header to the next one.
std::string section(const std::string& yaml, const std::string& name) {
  const auto begin = yaml.find(std::string(1, '\n').append(name).append(":\n"));
  if (begin == std::string::npos) return {};
  return yaml.substr(begin, yaml.find("\n\n", begin) - begin);
}

TEST_CASE("config/robot.yaml shows every key with its default", "[robot]") {
  std::ifstream stream("config/robot.yaml");
  const std::string shipped(std::istreambuf_iterator<char>(stream), {});
  const std::string effective = std::string(1, '\n').append(load_robot_config({}).effective);
  for (const char* name :
       {"run", "sensors", "tracker", "vio", "keyframe_features", "place_recognition",
        "loop_closure", "pcm", "pose_graph", "graph_playback", "mapping", "stereo_depth",
        "segmentation", "semantic_mapping", "mesh_deformation"}) {
    CAPTURE(name);
    CHECK_FALSE(section(effective, name).empty());
    CHECK(section(shipped, name) == section(effective, name));
  }
}

TEST_CASE("The effective configuration gives the same configuration again", "[robot]") {
  RobotOptions options;
  options.configs = {"config/datasets/tunnels.yaml"};
  options.settings = {"vio.iterations=5", "dds.team=blue"};
  const std::string effective = load_robot_config(options).effective;
  const TemporaryFolder folder;
  RobotOptions again;
  again.configs = {folder.write("effective.yaml", effective)};
  CHECK(load_robot_config(again).effective == effective);
}

TEST_CASE("What comes later wins: profile, files, settings, options", "[robot]") {
  RobotOptions options;
  options.link = "wifi";
  options.settings = {"dds.domain=7", "dds.lease_s=33", "dds.interface=eth9"};
  options.domain = 9;
  const RobotConfig config = load_robot_config(options);
  CHECK(config.run.link == "wifi");
  CHECK(config.dds.max_message_bytes < 1500);  // from the profile
  CHECK(config.dds.lease_s == 33.0);
  CHECK(config.dds.interface == "eth9");
  CHECK(config.dds.domain == 9);
  options.peers = {"10.0.0.2"};
  CHECK(load_robot_config(options).dds.discovery == Discovery::kPeers);
}

TEST_CASE("Every shipped configuration loads", "[robot]") {
  for (const char* file :
       {"config/robot.yaml", "config/datasets/euroc.yaml", "config/datasets/tunnels.yaml"})
    for (const char* link : {"wired", "wifi", "intermittent"}) {
      CAPTURE(file, link);
      RobotOptions options;
      options.configs = {file};
      options.link = link;
      CHECK_NOTHROW(load_robot_config(options));
    }
}

TEST_CASE("A link profile that does not exist is named with the places looked at", "[robot]") {
  RobotOptions options;
  options.link = "pigeon";
  CHECK_THROWS_WITH(load_robot_config(options), Catch::Contains("qos/pigeon.yaml") &&
                                                    Catch::Contains("config/qos/pigeon.yaml"));
}

}  // namespace
}  // namespace km
