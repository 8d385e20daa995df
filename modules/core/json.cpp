#include "modules/core/json.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "modules/core/input_file.hpp"
#include "modules/core/text_rows.hpp"

namespace km {

std::string json_text(const Json& json) {
  constexpr int kIndent = 2;
  return json.dump(kIndent, ' ', false, Json::error_handler_t::replace) + '\n';
}

Json read_json(const std::filesystem::path& file) try {
  return Json::parse(read_input_file(file));
} catch (const Json::exception& error) {
  throw std::runtime_error(file.string() + ": " + readable(error.what()));
}

}  // namespace km
