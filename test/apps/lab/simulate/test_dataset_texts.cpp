#include <catch2/catch.hpp>

#include "apps/lab/simulate/dataset_texts.hpp"

namespace km {
namespace {

// The line of team.yaml with the options of all robots, or nothing.
std::string arguments_of(const SimulationOptions& options) {
  const std::string text = team_yaml(options);
  const auto begin = text.find("arguments: ");
  return begin == std::string::npos ? "" : text.substr(begin, text.find('\n', begin) - begin);
}

TEST_CASE("The settings of the team file fit the recordings", "[simulate]") {
  SimulationOptions options;
  options.names = {"a", "b"};
  options.depth = false;
  CHECK(arguments_of(options) ==
        "arguments: [--set, vio.drift_rotation=2e-4, --set, vio.drift_translation=0.002]");
  options.depth = options.labels = true;
  options.world = WorldKind::kViconRoom;
  CHECK(arguments_of(options) ==
        "arguments: [--set, mapping.mode=semantic, --set, semantic_mapping.voxel_size_m=0.05, "
        "--set, vio.drift_rotation=2e-4, --set, vio.drift_translation=0.002]");
  options.labels = false;
  options.world = WorldKind::kCamp;
  options.truths = {"a.csv", "b.csv"};
  CHECK(arguments_of(options) == "arguments: [--set, mapping.mode=metric]");
  options.depth = false;
  CHECK(arguments_of(options).empty());
  CHECK(team_yaml(options).find("\nrobots:\n  - id: 0\n    name: \"a\"\n") != std::string::npos);
}

}  // namespace
}  // namespace km
