#pragma once

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <string_view>

namespace km {

/// A line on standard error that is rewritten, once the work takes more than two seconds; silent
/// where nobody looks.
class StageProgress {
 public:
  StageProgress() = default;
  StageProgress(const StageProgress&) = delete;
  StageProgress& operator=(const StageProgress&) = delete;
  ~StageProgress() {
    if (shown_) std::cerr << "\r\x1b[K" << std::flush;
  }

  void operator()(std::string_view stage, double share) {
    if (!terminal_ || std::chrono::steady_clock::now() - start_ < std::chrono::seconds(2)) return;
    shown_ = true;
    std::cerr << "\r\x1b[K" << stage;
    if (share > 0.0) std::cerr << ": " << std::lround(100.0 * share) << " %";
    std::cerr << std::flush;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  bool terminal_ = isatty(STDERR_FILENO) == 1;
  bool shown_ = false;
};

}  // namespace km
