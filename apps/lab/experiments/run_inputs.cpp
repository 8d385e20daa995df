#include "apps/lab/experiments/run_inputs.hpp"

#include <nlohmann/json.hpp>
#include <string>

#include "apps/output_file.hpp"
#include "modules/core/json.hpp"

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
  const Json json = read_json(file);
  const auto path = [&](const char* key) -> fs::path { return json.at(key).get<std::string>(); };
  return RunInputs{.data = path("data"),
                   .graphs = path("graphs"),
                   .euroc = path("euroc"),
                   .config = path("config"),
                   .quick = json.at("quick").get<bool>()};
} catch (const std::exception&) {
  return std::nullopt;  // cut short: the next run writes it again
}

void write_run_inputs(const fs::path& results, const RunInputs& inputs) {
  const auto text = [](const fs::path& path) {
    return path.empty() ? std::string() : fs::absolute(path).lexically_normal().string();
  };
  fs::create_directories(results);
  write_output(inputs_file(results), [&](std::ostream& out) {
    out << json_text({{"data", text(inputs.data)},
                      {"graphs", text(inputs.graphs)},
                      {"euroc", text(inputs.euroc)},
                      {"config", text(inputs.config)},
                      {"quick", inputs.quick}});
  });
}

}  // namespace km
