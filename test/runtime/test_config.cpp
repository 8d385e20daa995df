#include "runtime/config_layers.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

enum class Colour { kRed, kGreen };

struct ToyConfig {
  static constexpr const char* kSection = "toy";
  int count = 3;
  double length_m = 0.1;
  std::uint8_t level = 1;
  bool flag = false;
  std::string name = "a \"b\": c";
  Colour colour = Colour::kGreen;
  std::vector<std::string> hosts = {"x"};
  std::optional<double> limit_m = 2.0;

  void visit_fields(auto& visitor) {
    visitor.field("limit_m", limit_m, {0.0, 5.0}, "the farthest, if there is one");
    visitor.field("count", count, {1, 10}, "how many");
    visitor.field("length_m", length_m, {0.0, 1.0});
    visitor.field("level", level, {0, 200});
    visitor.field("flag", flag, "on or off");
    visitor.field("name", name);
    visitor.field("colour", colour, {{"red", Colour::kRed}, {"green", Colour::kGreen}});
    visitor.field("hosts", hosts);
  }
  bool operator==(const ToyConfig&) const = default;
};

ToyConfig loaded(ConfigLayers& layers) {
  const auto config = layers.load<ToyConfig>();
  layers.finish();
  return config;
}

std::string complaint(const std::string& yaml) try {
  ConfigLayers layers;
  layers.add_text(yaml, "a.yaml");
  loaded(layers);
  return "";
} catch (const ConfigError& error) {
  return error.what();
}

TEST_CASE("A key without a value is an empty text, or none where that is accepted") {
  ConfigLayers file, command_line;
  file.add_text("toy:\n  limit_m:\n  name:\n", "a.yaml");
  const ToyConfig empty = loaded(file);
  CHECK(!empty.limit_m);
  CHECK(empty.name.empty());
  command_line.add_override("toy.name=");
  CHECK(loaded(command_line).name.empty());
}

TEST_CASE("A configuration error names every problem with file and line") {
  const std::string text = complaint(
      "toy:\n  count: many\n  length_m: 7\n  level: 256\n  flag: perhaps\n  colour: blue\n"
      "  hosts: {a: b}\n  cuont: 1\n  length_m: .nan\nelsewhere:\n  x: 1\n");
  CHECK_THAT(text, Contains("a.yaml:2: toy.count = many is not a whole number, 1 .. 10"));
  CHECK_THAT(text, Contains("a.yaml:3: toy.length_m = 7 is outside 0 .. 1"));
  CHECK_THAT(text, Contains("a.yaml:4: toy.level = 256 is not a whole number, 0 .. 200"));
  CHECK_THAT(text, Contains("a.yaml:5: toy.flag = perhaps is not true or false"));
  CHECK_THAT(text, Contains("a.yaml:6: toy.colour = blue is not one of: red | green"));
  CHECK_THAT(text, Contains("a.yaml:7: toy.hosts = {a: b} is not a list"));
  CHECK_THAT(text, Contains("a.yaml:8: unknown key toy.cuont (did you mean count?)"));
  CHECK_THAT(text, Contains("a.yaml:9: toy.length_m is repeated, see a.yaml:3"));
  CHECK_THAT(text, Contains("a.yaml:10: unknown section elsewhere"));
}

TEST_CASE("A bad value is refused with its place and the reason") {
  for (const auto& [yaml, reason] : std::vector<std::pair<std::string, std::string>>{
           {"toy: {length_m: .nan}", "toy.length_m = .nan is outside"},
           {"toy: {count: 1.5}", "toy.count = 1.5 is not a whole number"},
           {"toy: {count: [1]}", "toy.count = [1] is not a whole number"},
           {"toy:\n  limit_m: far\n", "a.yaml:2: toy.limit_m = far is not a number"},
           {"toy:\n  count:\n", "not a whole number"},
           {"toy:\n  count: [1, 2\nmore", "not YAML"},
           {"- 1\n", "a.yaml:1: the file is not a map of keys and values"},
           {"\ntoy: 3\n", "a.yaml:2: toy is not a map of keys and values"}})
    CHECK_THAT(complaint(yaml), Contains("a.yaml:") && Contains(reason));
  ConfigLayers layers;
  layers.add_file("no/such/file.yaml");
  CHECK_THROWS_WITH(layers.finish(), Contains("no/such/file.yaml: cannot open"));
}

TEST_CASE("A corrupted configuration is refused by name or keeps the bounds") {
  const TemporaryFolder folder;
  check_corrupted<ConfigError>(
      "# a toy\ntoy:\n  count: 5\n  length_m: 0.75  # [m]\n  flag: true\n  colour: green\n"
      "  hosts: [a, b]\n  name: \"some\"\n",
      "corrupted.yaml", [&](const std::string& text) {
        ConfigLayers layers;
        layers.add_file(folder.write("corrupted.yaml", text));
        const auto toy = layers.load<ToyConfig>();
        layers.finish();
        CHECK_NOTHROW(checked(toy));
      });
}

TEST_CASE("YAML that refers to itself or grows without end is refused or ends") {
  CHECK_THAT(complaint("toy: {count: &a [*a]}"), Contains("a.yaml:1"));
  CHECK_THAT(complaint("toy: &a\n  count: *a\n"), Contains("a.yaml"));
  CHECK_THAT(complaint("toy: {count: " + std::string(100'000, '[') + "}"), Contains("not YAML"));
  std::string laughs = "a0: &a0 [x, x]\n";
  for (int i = 1; i < 40; ++i)
    laughs += 'a' + std::to_string(i) + ": &a" + std::to_string(i) + " [*a" +
              std::to_string(i - 1) + ", *a" + std::to_string(i - 1) + "]\n";
  CHECK_THAT(complaint(laughs + "toy: {count: *a39}\n"), Contains("toy.count"));
}

TEST_CASE("A thousand problems are reported by the first ones and a count") {
  std::string yaml = "toy:\n";
  for (int i = 0; i < 1000; ++i) yaml += "  key" + std::to_string(i) + ": 1\n";
  const std::string text = complaint(yaml);
  CHECK_THAT(text, Contains("a.yaml:2: unknown key toy.key0") && Contains(" more problems"));
  CHECK(text.size() < 5000);
}

TEST_CASE("A file that is no configuration is refused by name") {
  check_no_files<ConfigError>(".yaml", [](const auto& place) { (void)load_yaml(place); });
}

TEST_CASE("Later layers win key by key, the command line last") {
  ConfigLayers layers;
  layers.add_text("toy:\n  count: 2\n  length_m: 0.5\n  name: first\n", "default.yaml");
  layers.add_text("toy:\n  length_m: 0.6\n  name: second\n", "robot.yaml");
  layers.add_override("toy.name=third");
  layers.add_override("toy.hosts=[10.0.0.1, 10.0.0.2]");
  const ToyConfig config = loaded(layers);
  CHECK(config.count == 2);
  CHECK(config.length_m == 0.6);
  CHECK(config.name == "third");
  CHECK(config.hosts == std::vector<std::string>{"10.0.0.1", "10.0.0.2"});
}

TEST_CASE("A bad value is blamed on the layer it came from") {
  ConfigLayers layers;
  layers.add_text("toy:\n  count: 99\n  length_m: 9\n", "default.yaml");
  layers.add_text("\ntoy:\n\n  count: 98\n", "robot.yaml");
  layers.add_override("toy.length_m=-1");
  layers.add_override("toy=1");
  CHECK_THROWS_WITH(loaded(layers),
                    Contains("robot.yaml:4: toy.count = 98 is outside 1 .. 10") &&
                        Contains("command line, toy.length_m=-1: toy.length_m = -1 is outside") &&
                        Contains("command line, toy=1: not of the form section.key=value") &&
                        !Contains("default.yaml"));
}

TEST_CASE("The effective configuration reads back to itself") {
  ConfigLayers layers;
  layers.add_text("toy: {length_m: 0.30000000000000004, name: 'x: #y', hosts: ['1', 'b, c']}", "a");
  const ToyConfig config = loaded(layers);
  CHECK_THAT(layers.effective(), Contains("# how many; 1 .. 10") && Contains("# red | green"));
  ConfigLayers again;
  again.add_text(layers.effective(), "effective.yaml");
  CHECK(loaded(again) == config);
}

}  // namespace
}  // namespace km
