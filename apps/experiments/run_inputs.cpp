#include "apps/experiments/run_inputs.hpp"

#include <yaml-cpp/yaml.h>

#include <string>

#include "apps/output_file.hpp"
#include "modules/core/json_writer.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

fs::path inputs_file(const fs::path& results) {
  return results / "inputs.json";
}

}  // namespace

std::optional<RunInputs> read_run_inputs(const fs::path& results) try {
  const fs::path file = inputs_file(results);
  if (!fs::is_regular_file(file)) return std::nullopt;
  const YAML::Node root = YAML::LoadFile(file.string());  // JSON is YAML
  const auto path = [&](const char* key) -> fs::path { return root[key].as<std::string>(); };
  return RunInputs{.data = path("data"),
                   .graphs = path("graphs"),
                   .euroc = path("euroc"),
                   .config = path("config"),
                   .quick = root["quick"].as<bool>()};
} catch (const YAML::Exception&) {
  return std::nullopt;  // cut short: the next run writes it anew
}

void write_run_inputs(const fs::path& results, const RunInputs& inputs) {
  const auto text = [](const fs::path& path) {
    return path.empty() ? std::string() : fs::absolute(path).lexically_normal().string();
  };
  fs::create_directories(results);
  write_output(inputs_file(results), [&](std::ostream& out) {
    JsonWriter json(out);
    json.begin_object();
    json.field("data", text(inputs.data));
    json.field("graphs", text(inputs.graphs));
    json.field("euroc", text(inputs.euroc));
    json.field("config", text(inputs.config));
    json.field("quick", inputs.quick);
    json.end_object();
  });
}

}  // namespace km
