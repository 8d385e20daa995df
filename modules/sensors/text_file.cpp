#include "modules/sensors/text_file.hpp"

#include <fstream>
#include <sstream>

#include "modules/sensors/dataset_reader.hpp"

namespace km {

std::string read_file(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file))
    throw DatasetError(file.string() + ": " +
                       (std::filesystem::exists(file) ? "not a file" : "no such file"));
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw DatasetError(file.string() + ": cannot be read");
  return std::move(text).str();
}

std::string at_line(const std::filesystem::path& file, int line) {
  return file.string() + " line " + std::to_string(line);
}

}  // namespace km
