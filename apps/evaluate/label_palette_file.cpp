#include "apps/evaluate/label_palette_file.hpp"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace km {

LabelPalette read_label_palette(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  if (!stream || !(text << stream.rdbuf()))
    throw std::runtime_error(file.string() + ": cannot be read");
  return parse_label_palette(text.str(), file.string());
}

std::filesystem::path palette_beside(const std::filesystem::path& mesh) {
  const std::filesystem::path file = mesh.parent_path() / "label_palette.csv";
  return std::filesystem::exists(file) ? file : std::filesystem::path();
}

}  // namespace km
