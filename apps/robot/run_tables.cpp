#include "apps/robot/run_tables.hpp"

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "modules/core/input_file.hpp"
#include "modules/core/text_rows.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

std::vector<TextRow> rows_below_header(std::string_view text) {
  std::vector<TextRow> rows = split_rows(text);
  if (!rows.empty()) rows.erase(rows.begin());
  return rows;
}

void check_fields(const TextRow& row, std::size_t count, const fs::path& file) {
  if (row.fields.size() < count)
    throw std::runtime_error(file.string() + " line " + std::to_string(row.line) + ": fewer than " +
                             std::to_string(count) + " fields");
}

double number(const TextRow& row, std::size_t i, const fs::path& file) {
  const auto value = number_in(row, i);
  if (!value || !std::isfinite(*value))
    throw std::runtime_error(file.string() + " line " + std::to_string(row.line) + ": field " +
                             std::to_string(i + 1) + " is not a number");
  return *value;
}

}  // namespace

std::vector<NumberRow> read_number_rows(const fs::path& file, std::size_t columns) {
  const std::string text = read_input_file(file);
  std::vector<NumberRow> rows;
  for (const TextRow& row : rows_below_header(text)) {
    NumberRow& values = rows.emplace_back();
    for (std::size_t i = 0; i < columns; ++i) values.push_back(number(row, i, file));
  }
  return rows;
}

std::vector<SentBytes> read_sent(const fs::path& file) {
  const std::string text = read_input_file(file);
  std::vector<SentBytes> sent;
  std::map<std::pair<std::string_view, std::string_view>, double> known;  // by topic and peer
  for (const TextRow& row : rows_below_header(text)) {
    check_fields(row, 8, file);
    const double time_s = number(row, 0, file), bytes = number(row, 6, file) + number(row, 7, file);
    if (sent.empty() || sent.back().time_s < time_s)
      sent.push_back(
          {time_s, sent.empty() ? std::map<std::string, double>() : sent.back().by_category});
    if (row.fields[1] == "out")
      sent.back().by_category[std::string(row.fields[3])] +=
          bytes - std::exchange(known[{row.fields[2], row.fields[4]}], bytes);
  }
  return sent;
}

std::vector<ModuleTiming> read_timing(const fs::path& file) {
  const std::string text = read_input_file(file);
  std::vector<ModuleTiming> modules;
  for (const TextRow& row : rows_below_header(text)) {
    check_fields(row, 6, file);
    modules.push_back({std::string(row.fields[0]), number(row, 1, file), number(row, 2, file),
                       number(row, 3, file), number(row, 4, file), number(row, 5, file)});
  }
  return modules;
}

}  // namespace km
