#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <type_traits>
#include <vector>

#include "apps/robot/robot_config.hpp"
#include "runtime/config_text.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

// Converts to every member of an aggregate.
struct Anything {
  template <typename T>
  operator T() const {  // NOLINT(google-explicit-constructor)
    return T();
  }
};

// Number of members of an aggregate.
template <typename Config, typename... Members>
constexpr std::size_t member_count() {
  if constexpr (requires { Config{Members{}..., Anything{}}; })
    return member_count<Config, Members..., Anything>();
  else
    return sizeof...(Members);
}

struct FieldCounter : FieldVisitor<FieldCounter> {
  std::size_t count = 0;
  void visit(const char* key, const auto& /*value*/, const auto& /*accepted*/,
             const std::string& text) {
    CAPTURE(key);
    CHECK_FALSE(text.empty());
    ++count;
  }
};

TEST_CASE("Every member of every section is a key, and has a text", "[robot]") {
  RobotConfig config;
  std::size_t sections = 0;
  config.visit_sections([&](auto& section) {
    using Section = std::remove_cvref_t<decltype(section)>;
    CAPTURE(Section::kSection);
    FieldCounter fields;
    section.visit_fields(fields);
    CHECK(fields.count == member_count<Section>());
    ++sections;
  });
  CHECK(sections == member_count<RobotConfig>() - 1);  // beside `effective`
}

TEST_CASE("config/robot.yaml shows every key with its default", "[robot]") {
  std::ifstream stream("config/robot.yaml");
  const std::string shipped(std::istreambuf_iterator<char>(stream), {});
  RobotConfig defaults;
  std::string expected;
  defaults.visit_sections([&](auto& section) {
    if (&section != static_cast<void*>(&defaults.dds)) expected += '\n' + to_yaml(section);
  });
  CHECK(shipped.substr(shipped.find("\n\n") + 1) == expected);
}

TEST_CASE("The effective configuration gives the same configuration again", "[robot]") {
  RobotOptions options;
  options.configs = {"config/datasets/tunnels.yaml"};
  options.settings = {"vio.start_s=1", "dds.team=blue"};
  const std::string effective = load_robot_config(options).effective;
  const TemporaryFolder folder;
  RobotOptions again;
  again.configs = {folder.write("effective.yaml", effective)};
  CHECK(load_robot_config(again).effective == effective);
}

TEST_CASE("Later sources have priority: profile, files, settings, options", "[robot]") {
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
  CHECK_FALSE(config.view.on);  // only if the owner asks for it
  options.view = true;
  CHECK(load_robot_config(options).view.on);
  options.peers = {"10.0.0.2"};
  CHECK(load_robot_config(options).dds.discovery == Discovery::kPeers);
}

TEST_CASE("Every shipped configuration loads", "[robot]") {
  std::vector<std::string> files = {"config/robot.yaml"};
  for (const auto& entry : std::filesystem::directory_iterator("config/datasets"))
    files.push_back(entry.path().string());
  CHECK(files.size() > 3);
  for (const std::string& file : files)
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
