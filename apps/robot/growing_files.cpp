#include "apps/robot/growing_files.hpp"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/core/io/write_file.hpp"

namespace km {

std::string GrowingFile::go_on() {
  std::string rows;
  results_.append(file_, [&rows](const auto& file) {
    if (is_there(file)) rows = read_input_file(file);
  });
  rows.resize(rows.rfind('\n') + 1);
  keep_bytes_ = rows.size();
  header_ = rows.substr(0, rows.find('\n') + 1);
  is_begun_ = !rows.empty();
  return rows;
}

void GrowingFile::flush() {
  const std::string rows = rows_.str();
  rows_.str({});
  if (header_.empty()) header_ = rows.substr(0, rows.find('\n') + 1);
  if (waiting_.size() + rows.size() <= kMaxWaiting_bytes)
    waiting_ += rows;
  else
    rows_lost_ = true;
  results_.append(file_, [this](const auto&) { append(); });
}

void GrowingFile::append() {
  if (keep_bytes_ && is_there(file_)) std::filesystem::resize_file(file_, *keep_bytes_);
  keep_bytes_.reset();
  if (is_begun_ && !is_there(file_) && is_there(file_.parent_path())) {
    waiting_.insert(0, header_);
    is_begun_ = false;
    rows_gone_ = true;
  }
  // The first part may end in the middle of a row; the next part is its continuation.
  if (!waiting_.empty()) append_to_file(file_, waiting_);
  is_begun_ = is_begun_ || !header_.empty();
  if (rows_gone_)
    throw std::runtime_error(file_.string() +
                             ": rows are missing, the file was deleted or moved during the run");
  if (rows_lost_)
    throw std::runtime_error(file_.string() + ": rows are missing, the disk was full for too long");
}

ProcessUsage process_usage() {
  ProcessUsage usage;
  rusage resources{};
  if (getrusage(RUSAGE_SELF, &resources) == 0) {
    const auto seconds = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    usage.system_s = seconds(resources.ru_stime);
    usage.cpu_s = seconds(resources.ru_utime) + usage.system_s;
    usage.page_faults = static_cast<std::uint64_t>(resources.ru_minflt);
    usage.peak_bytes = 1024 * static_cast<std::uint64_t>(resources.ru_maxrss);
  }
  std::uint64_t pages = 0, resident_pages = 0;
  if (std::ifstream("/proc/self/statm") >> pages >> resident_pages)
    usage.resident_bytes = resident_pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return usage;
}

void return_freed_memory() {
  malloc_trim(0);
}

ProcessCsv::ProcessCsv(std::ostream& output, std::string_view former) : output_(output) {
  if (former.empty()) output_ << "time_s,cpu_s,resident_bytes,system_s,page_faults\n";
  for (const TextRow& row : split_rows(former)) {
    former_s_ = number_in(row, 0).value_or(former_s_);
    former_.cpu_s = number_in(row, 1).value_or(former_.cpu_s);
    former_.system_s = number_in(row, 3).value_or(former_.system_s);
    former_.page_faults = static_cast<std::uint64_t>(
        number_in(row, 4).value_or(static_cast<double>(former_.page_faults)));
  }
}

void ProcessCsv::append(double time_s, const ProcessUsage& usage) {
  char line[160];
  std::snprintf(line, sizeof line, "%.3f,%.3f,%llu,%.3f,%llu\n", time_s,
                former_.cpu_s + usage.cpu_s, static_cast<unsigned long long>(usage.resident_bytes),
                former_.system_s + usage.system_s,
                static_cast<unsigned long long>(former_.page_faults + usage.page_faults));
  output_ << line;
  samples_.push_back({time_s, usage});
}

ProcessSummary ProcessCsv::summary() const {
  constexpr double kLeastSpan_s = 60.0;
  if (samples_.empty()) return {};
  const Sample &first = samples_.front(), &last = samples_.back();
  ProcessSummary process{.cpu_s = last.usage.cpu_s,
                         .system_s = last.usage.system_s,
                         .page_faults = last.usage.page_faults,
                         .peak_memory_bytes = last.usage.peak_bytes,
                         .memory_at_start_bytes = first.usage.resident_bytes,
                         .memory_at_end_bytes = last.usage.resident_bytes,
                         .memory_growth_bytes_per_minute = std::nullopt};
  const double half_s = 0.5 * (first.time_s + last.time_s);
  if (last.time_s - half_s < kLeastSpan_s) return process;
  double n = 0.0, t = 0.0, y = 0.0, tt = 0.0, ty = 0.0;
  for (const auto& [time_s, usage] : samples_) {
    const double since_s = time_s - half_s;
    if (since_s < 0.0) continue;
    const auto bytes = static_cast<double>(usage.resident_bytes);
    n += 1.0;
    t += since_s;
    y += bytes;
    tt += since_s * since_s;
    ty += since_s * bytes;
  }
  const double spread = n * tt - t * t;
  if (spread > 0.0) process.memory_growth_bytes_per_minute = 60.0 * (n * ty - t * y) / spread;
  return process;
}

RoundsCsv::RoundsCsv(std::ostream& output, std::string_view former) : output_(output) {
  if (former.empty()) output_ << "seconds,round,members,cost,gradient_norm\n";
  for (const TextRow& row : split_rows(former)) {
    former_s_ = number_in(row, 0).value_or(former_s_);
    former_rounds_ =
        static_cast<std::uint32_t>(number_in(row, 1).value_or(static_cast<double>(former_rounds_)));
  }
}

void RoundsCsv::append(const std::vector<OptimizerProgress>& rounds) {
  for (; written_ < rounds.size(); ++written_) {
    const OptimizerProgress& row = rounds[written_];
    output_ << former_s_ + row.seconds << ',' << former_rounds_ + row.round << ','
            << row.members.size() << ',' << row.cost << ',' << row.gradient_norm << '\n';
  }
}

}  // namespace km
