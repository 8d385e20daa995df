#include "runtime/config_text.hpp"

#include <yaml-cpp/yaml.h>

namespace km {

std::string ConfigText::quoted(const std::string& value) {
  YAML::Emitter emitter;
  emitter << YAML::DoubleQuoted << value;
  return emitter.c_str();
}

void ConfigText::line(const char* key, const std::string& value, const std::string& comment,
                      const std::string& accepted) {
  constexpr std::size_t kCommentColumn = 36;
  std::string text = std::string("  ") + key + ": " + value;
  const std::string separator = !comment.empty() && !accepted.empty() ? "; " : "";
  if (!comment.empty() || !accepted.empty()) {
    text.resize(std::max(text.size() + 2, kCommentColumn), ' ');
    text += "# " + comment + separator + accepted;
  }
  text_ += text + '\n';
}

}  // namespace km
