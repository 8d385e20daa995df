#include "apps/lab/simulation/dataset/dataset_record.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "modules/core/json.hpp"

namespace km {
namespace {

const std::string* find(const ParameterList& list, const std::string& name) {
  const auto at = std::find_if(list.begin(), list.end(),
                               [&name](const auto& entry) { return entry.first == name; });
  return at == list.end() ? nullptr : &at->second;
}

std::string shown(const std::string* value) {
  if (value == nullptr) return "not set";
  return value->empty() ? "none" : *value;
}

}  // namespace

std::string to_json(const DatasetRecord& record) {
  Json parameters = Json::object();
  for (const auto& [name, value] : record.parameters) parameters[name] = value;
  return json_text({{"generator", record.generator},
                    {"parameters", std::move(parameters)},
                    {"finished_robots", record.finished_robots},
                    {"complete", record.complete}});
}

std::vector<std::string> differences(const DatasetRecord& found, const DatasetRecord& wanted) {
  std::vector<std::string> lines;
  const auto compare = [&lines](const std::string& name, const std::string* there,
                                const std::string* asked) {
    if (shown(there) != shown(asked))
      lines.push_back(name + ": " + shown(there) + " there, " + shown(asked) + " asked for");
  };
  compare("generator", &found.generator, &wanted.generator);
  for (const auto& [name, value] : wanted.parameters)
    compare(name, find(found.parameters, name), &value);
  for (const auto& [name, value] : found.parameters)
    if (find(wanted.parameters, name) == nullptr) compare(name, &value, nullptr);
  return lines;
}

}  // namespace km
