#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// Visitor that writes a config struct as YAML, with each field's comment and bounds beside it.
/// What it writes can be read back and gives the same values.
class ConfigText {
 public:
  template <typename T>
  requires std::is_arithmetic_v<T>
  void field(const char* key, const T& value, const Bounds<std::type_identity_t<T>>& bounds,
             const char* comment = "") {
    if constexpr (std::is_same_v<T, bool>) return field(key, value, comment);
    line(key, number(value), comment, number(bounds.min) + " .. " + number(bounds.max));
  }

  template <typename T, std::size_t N>
  requires std::is_enum_v<T>
  void field(const char* key, const T& value, const Choice<std::type_identity_t<T>> (&choices)[N],
             const char* comment = "") {
    std::string name, names;
    for (const auto& choice : choices) {
      if (choice.value == value) name = choice.name;
      names += (names.empty() ? "" : " | ") + std::string(choice.name);
    }
    line(key, name, comment, names);
  }

  void field(const char* key, const bool& value, const char* comment = "") {
    line(key, value ? "true" : "false", comment, "");
  }
  void field(const char* key, const std::string& value, const char* comment = "") {
    line(key, quoted(value), comment, "");
  }
  void field(const char* key, const std::vector<std::string>& value, const char* comment = "") {
    std::string list;
    for (const std::string& entry : value) list += (list.empty() ? "" : ", ") + quoted(entry);
    line(key, '[' + list + ']', comment, "");
  }

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  template <typename T>
  static std::string number(T value) {
    std::array<char, 32> buffer{};
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
    return {buffer.data(), end};
  }
  static std::string quoted(const std::string& value);
  void line(const char* key, const std::string& value, const std::string& comment,
            const std::string& accepted);

  std::string text_;
};

/// `config` as a YAML section.
template <typename Config>
[[nodiscard]] std::string to_yaml(Config config) {
  ConfigText text;
  config.visit_fields(text);
  return std::string(Config::kSection) + ":\n" + text.text();
}

}  // namespace km
