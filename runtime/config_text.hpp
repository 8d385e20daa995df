#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// A value as YAML text; empty if it cannot be written.
template <typename T, typename Accepted>
[[nodiscard]] std::string yaml_text(const T& value, const Accepted& accepted) {
  if constexpr (std::is_enum_v<T>)
    return accepted.name_of(value);
  else if constexpr (std::is_same_v<T, bool>)
    return value ? "true" : "false";
  else
    return shortest_text(value);
}
[[nodiscard]] std::string yaml_text(const std::string& value, AnyValue accepted);
template <typename Accepted>
[[nodiscard]] std::string yaml_text(const std::filesystem::path& value, const Accepted&) {
  return yaml_text(value.string(), AnyValue{});
}
template <typename T, typename Accepted>
[[nodiscard]] std::string yaml_text(const std::optional<T>& value, const Accepted& accepted) {
  return value ? yaml_text(*value, accepted) : "";
}
template <typename T, typename Accepted>
[[nodiscard]] std::string yaml_text(const std::vector<T>& values, const Accepted& accepted) {
  std::string list;
  for (const T& value : values) list += (list.empty() ? "" : ", ") + yaml_text(value, accepted);
  return '[' + list + ']';
}

/// Visitor that writes a config struct as YAML, with the description and bounds of each field
/// beside it. Reading this YAML restores the value of every field, except for empty lists (see
/// sections()).
class ConfigText : public FieldVisitor<ConfigText> {
 public:
  /// `indent`: before every line.
  explicit ConfigText(std::string indent = "  ") : indent_(std::move(indent)) {}

  template <typename T, typename Accepted>
  void visit(const char* key, const T& value, const Accepted& accepted, const char* text) {
    line(key, yaml_text(value, accepted), text, accepted.text());
  }

  template <typename Config>
  void section(const char* key, Config& config, const char* text = "") {
    line(key, "", text, "");
    indent_ += "  ";
    config.visit_fields(*this);
    indent_.resize(indent_.size() - 2);
  }

  /// An empty list is written with one element that has the default values.
  template <typename Config>
  void sections(const char* key, std::vector<Config> list, const char* text = "") {
    if (list.empty()) list.emplace_back();
    line(key, "", text, "");
    indent_ += "    ";
    for (Config& config : list) {
      const std::size_t begin = text_.size();
      config.visit_fields(*this);
      text_[begin + indent_.size() - 2] = '-';
    }
    indent_.resize(indent_.size() - 4);
  }

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void line(const char* key, const std::string& value, const std::string& text,
            const std::string& accepted);

  std::string indent_;
  std::string text_;
};

/// The fields of `config` as YAML, without the name of the section.
template <typename Config>
[[nodiscard]] std::string keys_of(Config config) {
  ConfigText text;
  config.visit_fields(text);
  return text.text();
}

/// `config` as a YAML section.
template <typename Config>
[[nodiscard]] std::string to_yaml(const Config& config) {
  return std::string(Config::kSection) + ":\n" + keys_of(config);
}

}  // namespace km
