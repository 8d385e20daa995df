#include "modules/core/io/json.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"

namespace km {

std::string json_text(const Json& json) {
  constexpr int kIndent = 2;
  return json.dump(kIndent, ' ', false, Json::error_handler_t::replace) + '\n';
}

Json read_json(const std::filesystem::path& file) try {
  constexpr int kMostLevels = 64;  // millions of brackets would take all memory
  return Json::parse(read_input_file(file), [](int level, Json::parse_event_t, const Json&) {
    if (level > kMostLevels)
      throw std::length_error("nested deeper than " + std::to_string(kMostLevels) + " levels");
    return true;
  });
} catch (const std::length_error& error) {
  throw std::runtime_error(file.string() + ": " + error.what());
} catch (const Json::exception& error) {
  throw std::runtime_error(file.string() + ": " + readable(error.what()));
}

}  // namespace km
