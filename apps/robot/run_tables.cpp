#include "apps/robot/run_tables.hpp"

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string_view>

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

std::vector<TrafficRow> read_traffic(const fs::path& file) {
  const std::string text = read_input_file(file);
  std::vector<TrafficRow> rows;
  for (const TextRow& row : rows_below_header(text)) {
    check_fields(row, 8, file);
    rows.push_back({number(row, 0, file), row.fields[1] == "out", std::string(row.fields[2]),
                    std::string(row.fields[3]), std::string(row.fields[4]), number(row, 5, file),
                    number(row, 6, file) + number(row, 7, file)});
  }
  return rows;
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

void TrafficUntil::advance(double time_s) {
  for (; next_ < rows_.size() && rows_[next_].time_s <= time_s; ++next_) {
    const TrafficRow& row = rows_[next_];
    auto& known = sums_[{row.out, row.topic, row.peer}];
    if (row.out) sent_[row.category] += row.bytes - known.bytes;
    if (const auto peer = parse_int64(row.peer); !row.out && peer && row.messages > known.messages)
      last_received_s_[static_cast<RobotId>(*peer)] = row.time_s;
    known = row;
  }
  time_s_ = time_s;
}

double TrafficUntil::sent(const std::string& category) const {
  const auto known = sent_.find(category);
  return known != sent_.end() ? known->second : 0.0;
}

std::map<RobotId, double> TrafficUntil::silent_s() const {
  std::map<RobotId, double> silent_s;
  for (const auto& [robot, received_s] : last_received_s_) silent_s[robot] = time_s_ - received_s;
  return silent_s;
}

}  // namespace km
