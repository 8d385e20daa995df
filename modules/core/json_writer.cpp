#include "modules/core/json_writer.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace km {

void JsonWriter::before_value() {
  if (after_key_) {
    after_key_ = false;
    return;
  }
  if (counts_.empty()) return;
  if (counts_.back()++ > 0) output_ << ',';
  output_ << '\n' << std::string(2 * counts_.size(), ' ');
}

void JsonWriter::key(std::string_view name) {
  before_value();
  quoted(name);
  output_ << ": ";
  after_key_ = true;
}

void JsonWriter::open(char bracket) {
  before_value();
  output_ << bracket;
  counts_.push_back(0);
}

void JsonWriter::close(char bracket) {
  const bool empty = counts_.back() == 0;
  counts_.pop_back();
  if (!empty) output_ << '\n' << std::string(2 * counts_.size(), ' ');
  output_ << bracket;
  if (counts_.empty()) output_ << '\n';
}

void JsonWriter::literal(std::string_view text) {
  before_value();
  output_ << text;
}

void JsonWriter::value(std::string_view text) {
  before_value();
  quoted(text);
}

void JsonWriter::value(double number) {
  if (!std::isfinite(number)) return literal("null");
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  literal({digits.data(), static_cast<std::size_t>(end - digits.data())});
}

void JsonWriter::quoted(std::string_view text) {
  constexpr std::string_view kHex = "0123456789abcdef";
  output_ << '"';
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      output_ << '\\' << c;
    else if (code < 0x20)
      output_ << "\\u00" << kHex[code >> 4U] << kHex[code & 15U];
    else
      output_ << c;
  }
  output_ << '"';
}

}  // namespace km
