#include "modules/core/json.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace km {

std::string json_text(const Json& json) {
  constexpr int kIndent = 2;
  return json.dump(kIndent, ' ', false, Json::error_handler_t::replace) + '\n';
}

Json read_json(const std::filesystem::path& file) try {
  if (!std::filesystem::is_regular_file(file))
    throw std::runtime_error(file.string() + ": no such file");
  std::ifstream in(file, std::ios::binary);
  return Json::parse(in);
} catch (const Json::parse_error& error) {
  throw std::runtime_error(file.string() + ": " + error.what());
}

std::optional<double> number_at(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  if (!json.contains(at) || !json.at(at).is_number()) return std::nullopt;
  return json.at(at).get<double>();
}

}  // namespace km
