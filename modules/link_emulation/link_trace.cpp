#include "modules/link_emulation/link_trace.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"

namespace km {
namespace {

constexpr std::size_t kColumns = 3;

// Index and problem of the first unusable row; an empty problem if `rows` are a trace.
std::pair<std::size_t, std::string> problem_of(const std::vector<LinkTraceRow>& rows) {
  if (rows.empty()) return {0, "has no row"};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const LinkTraceRow& row = rows[i];
    if (!(row.bytes_per_s >= 0.0)) return {i, "bytes_per_s is below zero"};
    if (std::isinf(row.bytes_per_s) && rows.size() > 1) return {i, "bytes_per_s is infinite"};
    if (!(row.delay_s >= 0.0) || std::isinf(row.delay_s)) return {i, "delay_s is below zero"};
    if (!std::isfinite(row.time_s)) return {i, "time_s is not finite"};
    if (i > 0 && row.time_s <= rows[i - 1].time_s)
      return {i, "time_s is not after that of the row before"};
  }
  return {};
}

// Bytes that the link can carry in the time `dt_s` after row `a`, if its rate changes by `slope`
// [bytes/s^2].
double capacity_over(const LinkTraceRow& a, double slope, double dt_s) {
  return dt_s * (a.bytes_per_s + 0.5 * slope * dt_s);
}

double slope_between(const LinkTraceRow& a, const LinkTraceRow& b) {
  return (b.bytes_per_s - a.bytes_per_s) / (b.time_s - a.time_s);
}

LinkTraceRow parse_trace_row(const TextRow& row, const std::string& where) {
  if (row.fields.size() != kColumns)
    throw LinkTraceError(where + std::to_string(row.fields.size()) +
                         " fields, expected time_s, bytes_per_s, delay_s");
  double values[kColumns] = {};
  for (std::size_t i = 0; i < kColumns; ++i) {
    const auto value = parse_double(row.fields[i]);
    if (!value || !std::isfinite(*value))
      throw LinkTraceError(where + readable(row.fields[i]) + " is not a finite number");
    values[i] = *value;
  }
  return {values[0], values[1], values[2]};
}

constexpr double kMs_per_s = 1e3;
constexpr double kRounding_ms = 1e-6;  // error of a time in seconds that stands for a whole number

std::uint32_t parse_time_ms(const TextRow& row, const std::string& where) {
  if (row.fields.size() != 1)
    throw LinkTraceError(where + std::to_string(row.fields.size()) + " fields, expected a time");
  const auto value = parse_int64(row.fields.front());
  if (!value || *value < 0 || *value > std::numeric_limits<std::uint32_t>::max())
    throw LinkTraceError(where + readable(row.fields.front()) +
                         " is not a whole number of milliseconds");
  return static_cast<std::uint32_t>(*value);
}

std::string text_of(const std::filesystem::path& file) try {
  return read_input_file(file);
} catch (const InputFileError& error) {
  throw LinkTraceError(error.what());
}

}  // namespace

LinkTrace::LinkTrace(std::vector<LinkTraceRow> rows) : rows_(std::move(rows)) {
  if (const auto [row, problem] = problem_of(rows_); !problem.empty())
    throw std::invalid_argument("link trace, row " + std::to_string(row) + ": " + problem);
  capacity_ = {0.0};
  for (std::size_t i = 1; i < rows_.size(); ++i)
    capacity_.push_back(capacity_.back() + capacity_over(rows_[i - 1],
                                                         slope_between(rows_[i - 1], rows_[i]),
                                                         rows_[i].time_s - rows_[i - 1].time_s));
}

bool LinkTrace::has_limit() const {
  return std::isfinite(rows_.front().bytes_per_s);
}

double LinkTrace::delay_s(double time_s) const {
  const auto after = std::ranges::upper_bound(rows_, time_s, {}, &LinkTraceRow::time_s);
  if (after == rows_.begin()) return rows_.front().delay_s;
  if (after == rows_.end()) return rows_.back().delay_s;
  const LinkTraceRow &a = *std::prev(after), &b = *after;
  return std::lerp(a.delay_s, b.delay_s, (time_s - a.time_s) / (b.time_s - a.time_s));
}

double LinkTrace::capacity_until(double time_s) const {
  const auto after = std::ranges::upper_bound(rows_, time_s, {}, &LinkTraceRow::time_s);
  if (after == rows_.begin()) return (time_s - rows_.front().time_s) * rows_.front().bytes_per_s;
  const auto i = static_cast<std::size_t>(after - rows_.begin()) - 1;
  const double slope = after == rows_.end() ? 0.0 : slope_between(rows_[i], *after);
  return capacity_[i] + capacity_over(rows_[i], slope, time_s - rows_[i].time_s);
}

double LinkTrace::time_of(double bytes) const {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const LinkTraceRow& first = rows_.front();
  if (bytes < 0.0)
    return first.bytes_per_s > 0.0 ? first.time_s + bytes / first.bytes_per_s : kNever;
  // Index of the last row up to whose time the link can carry less than `bytes`; at least 0.
  const auto reached = std::ranges::lower_bound(capacity_, bytes);
  const auto i =
      static_cast<std::size_t>(std::max<std::ptrdiff_t>(reached - capacity_.begin() - 1, 0));
  const double missing = bytes - capacity_[i];
  if (missing <= 0.0) return rows_[i].time_s;
  const double slope = i + 1 < rows_.size() ? slope_between(rows_[i], rows_[i + 1]) : 0.0;
  // The root of capacity_over() = missing, in the form that also holds for a slope of zero. If the
  // rate falls to zero, rounding may make the radicand negative.
  const double rate = rows_[i].bytes_per_s;
  const double divisor = rate + std::sqrt(std::max(rate * rate + 2.0 * slope * missing, 0.0));
  return divisor > 0.0 ? rows_[i].time_s + 2.0 * missing / divisor : kNever;
}

LinkTrace parse_link_trace(std::string_view text, const std::string& name) {
  std::vector<TextRow> table = split_rows(text);
  if (!table.empty() && table.front().fields.front() == "time_s") table.erase(table.begin());
  const auto where = [&](std::size_t row) {
    return name + (row < table.size() ? ':' + std::to_string(table[row].line) : "") + ": ";
  };
  std::vector<LinkTraceRow> rows;
  rows.reserve(table.size());
  for (const TextRow& row : table) rows.push_back(parse_trace_row(row, where(rows.size())));
  if (const auto [row, problem] = problem_of(rows); !problem.empty())
    throw LinkTraceError(where(row) + problem);
  return LinkTrace(std::move(rows));
}

LinkTrace read_link_trace(const std::filesystem::path& file) {
  return parse_link_trace(text_of(file), file.string());
}

PacketSchedule::PacketSchedule(std::vector<std::uint32_t> times_ms)
    : times_ms_(std::move(times_ms)) {
  if (times_ms_.empty() || times_ms_.back() == 0 || !std::ranges::is_sorted(times_ms_))
    throw std::invalid_argument("packet schedule: times decrease, or the last one is 0 or missing");
}

double PacketSchedule::capacity_until(double time_s) const {
  const double time_ms = std::floor(time_s * kMs_per_s + kRounding_ms);
  const double periods = std::floor(time_ms / times_ms_.back());
  const double rest_ms = time_ms - periods * times_ms_.back();
  const auto passed = std::ranges::upper_bound(times_ms_, rest_ms) - times_ms_.begin();
  return kPacket_bytes *
         (periods * static_cast<double>(times_ms_.size()) + static_cast<double>(passed));
}

double PacketSchedule::time_of(double bytes) const {
  if (bytes <= 0.0) return 0.0;
  const double before = std::ceil(bytes / kPacket_bytes) - 1.0;  // instants before the one sought
  const double periods = std::floor(before / static_cast<double>(times_ms_.size()));
  const auto i = static_cast<std::size_t>(before - periods * static_cast<double>(times_ms_.size()));
  return (periods * times_ms_.back() + times_ms_[i]) / kMs_per_s;
}

PacketSchedule parse_packet_schedule(std::string_view text, const std::string& name) {
  std::vector<std::uint32_t> times_ms;
  for (const TextRow& row : split_rows(text)) {
    const std::string where = name + ':' + std::to_string(row.line) + ": ";
    times_ms.push_back(parse_time_ms(row, where));
    if (times_ms.size() > 1 && times_ms.back() < times_ms[times_ms.size() - 2])
      throw LinkTraceError(where + readable(row.fields.front()) + " is before the time above it");
  }
  if (times_ms.empty() || times_ms.back() == 0)
    throw LinkTraceError(name + ": the last time is 0 or missing");
  return PacketSchedule(std::move(times_ms));
}

PacketSchedule read_packet_schedule(const std::filesystem::path& file) {
  return parse_packet_schedule(text_of(file), file.string());
}

}  // namespace km
