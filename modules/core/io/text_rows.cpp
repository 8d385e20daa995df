#include "modules/core/io/text_rows.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <utility>

namespace km {
namespace {

constexpr std::string_view kBlanks = " \t\f\v";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string_view unquoted(std::string_view field) {
  const bool is_quoted = field.size() > 1 && field.starts_with('"') && field.ends_with('"');
  return is_quoted ? field.substr(1, field.size() - 2) : field;
}

std::vector<std::string_view> split_at(char separator, std::string_view line,
                                       std::size_t max_fields) {
  std::vector<std::string_view> fields;
  while (fields.size() < max_fields) {
    const std::size_t end = line.find(separator);
    fields.push_back(unquoted(trimmed(line.substr(0, end))));
    if (end == line.npos) break;
    line.remove_prefix(end + 1);
  }
  return fields;
}

std::vector<std::string_view> split_at_blanks(std::string_view line, std::size_t max_fields) {
  std::vector<std::string_view> fields;
  while (!line.empty() && fields.size() < max_fields) {
    const std::size_t end = std::min(line.find_first_of(kBlanks), line.size());
    fields.push_back(line.substr(0, end));
    line = trimmed(line.substr(end));
  }
  return fields;
}

template <typename T>
std::optional<T> parse_whole(std::string_view field) {
  if (field.starts_with('+')) field.remove_prefix(1);
  T value{};
  const char* const end = field.data() + field.size();
  const auto [stopped, error] = std::from_chars(field.data(), end, value);
  if (error != std::errc() || stopped != end) return std::nullopt;
  return value;
}

}  // namespace

RowReader::RowReader(std::string_view text, std::size_t max_fields)
    : text_(text), max_fields_(max_fields) {
  if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
}

std::optional<TextRow> RowReader::next() {
  while (!text_.empty()) {
    ++line_;
    const std::size_t end = std::min(text_.find_first_of("\r\n"), text_.size());
    std::string_view line = text_.substr(0, end);
    text_.remove_prefix(text_.substr(end).starts_with("\r\n") ? end + 2
                                                              : std::min(end + 1, text_.size()));
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty() || line == "\"") continue;  // a quoted comment leaves its first quote
    for (const char separator : {',', ';'})
      if (line.find(separator) != line.npos)
        return TextRow{line_, split_at(separator, line, max_fields_)};
    return TextRow{line_, split_at_blanks(line, max_fields_)};
  }
  return std::nullopt;
}

std::vector<TextRow> split_rows(std::string_view text) {
  std::vector<TextRow> rows;
  RowReader reader(text);
  while (auto row = reader.next()) rows.push_back(*std::move(row));
  return rows;
}

std::optional<double> parse_double(std::string_view field) {
  return parse_whole<double>(field);
}

std::optional<std::int64_t> parse_int64(std::string_view field) {
  return parse_whole<std::int64_t>(field);
}

std::optional<double> number_in(const TextRow& row, std::size_t i) {
  return i < row.fields.size() ? parse_double(row.fields[i]) : std::nullopt;
}

std::string readable(std::string_view text, std::size_t max_size) {
  constexpr std::string_view kCut = " ...";
  std::string shown(text.substr(0, max_size));
  if (text.size() > max_size) shown.replace(shown.size() - kCut.size(), kCut.size(), kCut);
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, '?');
  return shown;
}

}  // namespace km
