#include "apps/lab/simulate/dataset_record.hpp"

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/lab/simulation/dataset/recording.hpp"
#include "apps/output_file.hpp"
#include "modules/core/io/json.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecordFile = "simulation.json";

DatasetRecord read_record(const fs::path& file) try {
  const Json root = Json::parse(std::ifstream(file));
  DatasetRecord record{.generator = root.at("generator").get<std::string>(), .parameters = {}};
  for (const auto& [name, value] : root.at("parameters").items())
    record.parameters.emplace_back(name, value.get<std::string>());
  record.complete = root.at("complete").get<bool>();
  return record;
} catch (const Json::exception& error) {
  throw std::runtime_error(file.string() + ": cannot be understood (" + error.what() +
                           "); choose another --output, or remove the folder");
}

// One line per difference: "duration: 30 there, 60 asked for".
std::string differences(const DatasetRecord& found, const DatasetRecord& wanted) {
  std::map<std::string, std::pair<std::string, std::string>> values;
  values["generator"] = {found.generator, wanted.generator};
  for (const auto& [name, value] : found.parameters) values[name].first = value;
  for (const auto& [name, value] : wanted.parameters) values[name].second = value;
  const auto shown = [](const std::string& value) { return value.empty() ? "none" : value; };
  std::string lines;
  for (const auto& [name, both] : values)
    if (both.first != both.second)
      lines +=
          "\n  " + name + ": " + shown(both.first) + " there, " + shown(both.second) + " asked for";
  return lines;
}

}  // namespace

DatasetRecord open_dataset(const fs::path& folder, const DatasetRecord& wanted) {
  make_output_folder(folder);
  const fs::path file = folder / kRecordFile;
  if (!fs::exists(file)) {
    if (!fs::is_empty(folder))
      throw std::runtime_error(folder.string() + " is not empty and not made by this program (no " +
                               kRecordFile + " in it); choose another --output");
    write_record(folder, wanted);
    return wanted;
  }
  const DatasetRecord found = read_record(file);
  const std::string lines = differences(found, wanted);
  if (lines.empty()) return found;
  throw std::runtime_error(folder.string() + " was made with other parameters:" + lines +
                           "\nGive the same ones to continue there, choose another --output, or "
                           "remove the folder.");
}

void write_record(const fs::path& folder, const DatasetRecord& record) {
  Json parameters = Json::object();
  for (const auto& [name, value] : record.parameters) parameters[name] = value;
  write_whole_file(folder / kRecordFile, json_text({{"generator", record.generator},
                                                    {"parameters", std::move(parameters)},
                                                    {"complete", record.complete}}));
}

}  // namespace km
