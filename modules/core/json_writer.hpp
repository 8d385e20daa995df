#pragma once

#include <cstddef>
#include <ostream>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace km {

/// Writes one JSON document, indented, in the order of the calls; commas and escapes are its
/// matter. Numbers keep the digits that tell doubles apart; NaN and infinities become null.
class JsonWriter {
 public:
  /// `output` outlives this.
  explicit JsonWriter(std::ostream& output) : output_(output) {}

  void begin_object() { open('{'); }
  void end_object() { close('}'); }
  void begin_array() { open('['); }
  void end_array() { close(']'); }

  /// Name of the next value; inside objects only.
  void key(std::string_view name);

  void value(std::string_view text);
  void value(const char* text) { value(std::string_view(text)); }
  void value(double number);
  void value(bool truth) { literal(truth ? "true" : "false"); }
  template <typename T>
  requires std::is_integral_v<T>
  void value(T number) { literal(std::to_string(number)); }

  template <typename T>
  void field(std::string_view name, const T& content) {
    key(name);
    value(content);
  }

  /// Fields one after the other: name, value, name, value, ...
  template <typename T, typename... Rest>
  void fields(std::string_view name, const T& content, const Rest&... rest) {
    field(name, content);
    if constexpr (sizeof...(rest) > 0) fields(rest...);
  }

  /// A field that is an array of objects; `write_fields(element)` writes those of one.
  template <typename Range>
  void objects(std::string_view name, const Range& elements, const auto& write_fields) {
    key(name);
    begin_array();
    for (const auto& element : elements) {
      begin_object();
      write_fields(element);
      end_object();
    }
    end_array();
  }

  /// A field that is an array of plain values.
  template <typename Range>
  void array(std::string_view name, const Range& contents) {
    key(name);
    begin_array();
    for (const auto& content : contents) value(content);
    end_array();
  }

 private:
  void open(char bracket);
  void close(char bracket);
  void before_value();
  void literal(std::string_view text);
  void quoted(std::string_view text);

  std::ostream& output_;
  std::vector<std::size_t> counts_;  // values so far in each open bracket
  bool after_key_ = false;
};

}  // namespace km
