#include "modules/core/map/label_palette.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "modules/core/io/text_rows.hpp"

namespace km {
namespace {

constexpr std::string_view kHeader = "name,red,green,blue,alpha,id";
constexpr std::size_t kFields = 6;

std::string text_of(const LabelClass::Color& color) {
  return std::to_string(color[0]) + "," + std::to_string(color[1]) + "," + std::to_string(color[2]);
}

void require_storable(const std::string& name) {
  constexpr std::string_view kBlanks = " \t\r\f\v";
  if (name.empty() || name.find_first_of(",#\n\r") != std::string::npos ||
      kBlanks.find(name.front()) != kBlanks.npos || kBlanks.find(name.back()) != kBlanks.npos) {
    throw std::invalid_argument(
        "label palette: the name '" + readable(name) +
        "' is empty, has blanks around it, or a comma, # or line end in it");
  }
}

std::uint8_t parse_byte(std::string_view field, const char* what, const std::string& place) {
  const std::optional<std::int64_t> value = parse_int64(field);
  if (!value || *value < 0 || *value > 255) {
    throw std::invalid_argument(place + what + " '" + readable(field) +
                                "' is no integer from 0 to 255");
  }
  return static_cast<std::uint8_t>(*value);
}

LabelClass parse_entry(const TextRow& row, const std::string& place) {
  if (row.fields.size() != kFields) {
    throw std::invalid_argument(place + "'" + readable(row.fields[0]) + "' with " +
                                std::to_string(row.fields.size()) + " fields, needed are " +
                                std::string(kHeader));
  }
  LabelClass entry;
  entry.name = row.fields[0];
  if (entry.name.empty()) throw std::invalid_argument(place + "the class has no name");
  entry.color = {parse_byte(row.fields[1], "red", place), parse_byte(row.fields[2], "green", place),
                 parse_byte(row.fields[3], "blue", place)};
  static_cast<void>(parse_byte(row.fields[4], "alpha", place));
  entry.id = parse_byte(row.fields[5], "id", place);
  return entry;
}

}  // namespace

LabelPalette::LabelPalette(const std::vector<LabelClass>& entries) {
  for (const LabelClass& entry : entries) {
    require_storable(entry.name);
    const auto [known, is_new] = id_by_color_.try_emplace(entry.color, entry.id);
    if (known->second != entry.id) {
      throw std::invalid_argument("label palette: the colour " + text_of(entry.color) + " of '" +
                                  readable(entry.name) + "' stands for id " +
                                  std::to_string(known->second) + " and id " +
                                  std::to_string(entry.id));
    }
    if (is_new)
      entries_.insert(std::ranges::upper_bound(entries_, entry.id, {}, &LabelClass::id), entry);
  }
  std::ranges::unique_copy(entries_, std::back_inserter(classes_), {}, &LabelClass::id);
}

const LabelClass* LabelPalette::find(LabelId id) const {
  const auto found = std::ranges::lower_bound(classes_, id, {}, &LabelClass::id);
  return found != classes_.end() && found->id == id ? &*found : nullptr;
}

std::optional<LabelId> LabelPalette::id_of(const LabelClass::Color& color) const {
  const auto found = id_by_color_.find(color);
  return found == id_by_color_.end() ? std::nullopt : std::optional(found->second);
}

LabelPalette parse_label_palette(std::string_view csv, std::string_view source) {
  const std::string where(source);
  const std::vector<TextRow> rows = split_rows(csv);
  const std::vector<std::string_view> header = {"name", "red", "green", "blue", "alpha", "id"};
  if (rows.empty() || rows.front().fields != header) {
    throw std::invalid_argument(where + ": the first line is not '" + std::string(kHeader) + "'");
  }
  std::vector<LabelClass> entries;
  std::map<LabelClass::Color, std::pair<LabelId, int>> first_use;  // id and line of a colour
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const int line = rows[i].line;
    const std::string place = where + ":" + std::to_string(line) + ": ";
    entries.push_back(parse_entry(rows[i], place));
    const LabelClass& entry = entries.back();
    const auto [use, is_new] = first_use.try_emplace(entry.color, entry.id, line);
    if (use->second.first != entry.id) {
      throw std::invalid_argument(
          place + "the colour " + text_of(entry.color) + " of '" + readable(entry.name) +
          "' stands for id " + std::to_string(entry.id) + ", but for id " +
          std::to_string(use->second.first) + " in line " + std::to_string(use->second.second));
    }
  }
  return LabelPalette(entries);
}

std::string to_csv(const LabelPalette& palette) {
  std::string csv(kHeader);
  csv += '\n';
  for (const LabelClass& entry : palette.entries()) {
    csv += entry.name + "," + text_of(entry.color) + ",255," + std::to_string(entry.id) + "\n";
  }
  return csv;
}

}  // namespace km
