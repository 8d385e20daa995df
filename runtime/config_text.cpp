#include "runtime/config_text.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <sstream>

namespace km {

std::string yaml_text(const std::string& value, AnyValue /*accepted*/) {
  YAML::Emitter emitter;
  emitter << YAML::DoubleQuoted << value;
  return emitter.c_str();
}

void ConfigText::line(const char* key, const std::string& value, const std::string& text,
                      const std::string& accepted) {
  constexpr std::size_t kCommentColumn = 36, kWidth = 120;
  std::string row = indent_ + key + ':' + (value.empty() ? "" : " ") + value;
  row.resize(std::max(row.size() + 2, kCommentColumn), ' ');
  row += '#';
  const auto append = [&](const std::string& piece) {
    if (row.size() + 1 + piece.size() > kWidth && !row.ends_with('#')) {
      text_ += row + '\n';
      row = std::string(kCommentColumn, ' ') + '#';
    }
    row += ' ' + piece;
  };
  std::istringstream words(!text.empty() && !accepted.empty() ? text + ';' : text);
  for (std::string word; words >> word;) append(word);
  if (!accepted.empty()) append(accepted);
  if (row.ends_with('#')) row.resize(row.find_last_not_of(" #") + 1);
  text_ += row + '\n';
}

}  // namespace km
