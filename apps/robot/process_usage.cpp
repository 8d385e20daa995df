#include "apps/robot/process_usage.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

namespace km {

ProcessUsage process_usage() {
  ProcessUsage usage;
  rusage resources{};
  if (getrusage(RUSAGE_SELF, &resources) == 0) {
    const auto seconds = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    usage.cpu_s = seconds(resources.ru_utime) + seconds(resources.ru_stime);
    usage.peak_bytes = 1024 * static_cast<std::uint64_t>(resources.ru_maxrss);
  }
  std::uint64_t pages = 0, resident_pages = 0;
  if (std::ifstream("/proc/self/statm") >> pages >> resident_pages)
    usage.resident_bytes = resident_pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return usage;
}

ProcessCsv::ProcessCsv(std::ostream& output) : output_(output) {
  output_ << "time_s,cpu_s,resident_bytes\n";
}

void ProcessCsv::append(double time_s, const ProcessUsage& usage) {
  char line[96];
  std::snprintf(line, sizeof line, "%.3f,%.3f,%llu\n", time_s, usage.cpu_s,
                static_cast<unsigned long long>(usage.resident_bytes));
  output_ << line;
  samples_.push_back({time_s, static_cast<double>(usage.resident_bytes)});
}

MemoryTrend ProcessCsv::memory() const {
  constexpr double kLeastSpan_s = 60.0;
  MemoryTrend trend;
  if (samples_.empty()) return trend;
  trend.first_bytes = static_cast<std::uint64_t>(samples_.front().bytes);
  trend.last_bytes = static_cast<std::uint64_t>(samples_.back().bytes);
  const double half_s = 0.5 * (samples_.front().time_s + samples_.back().time_s);
  if (samples_.back().time_s - half_s < kLeastSpan_s) return trend;
  double n = 0.0, t = 0.0, y = 0.0, tt = 0.0, ty = 0.0;
  for (const Sample& sample : samples_) {
    const double since_s = sample.time_s - half_s;
    if (since_s < 0.0) continue;
    n += 1.0;
    t += since_s;
    y += sample.bytes;
    tt += since_s * since_s;
    ty += since_s * sample.bytes;
  }
  const double spread = n * tt - t * t;
  if (spread > 0.0) trend.growth_bytes_per_minute = 60.0 * (n * ty - t * y) / spread;
  return trend;
}

}  // namespace km
