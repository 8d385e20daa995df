#pragma once

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <string>
#include <string_view>

namespace km {

/// Progress line on standard error, rewritten once the work takes more than two seconds. It shows
/// the remaining time of the stage. Nothing is printed if standard error is no terminal.
class StageProgress {
 public:
  StageProgress() = default;
  StageProgress(const StageProgress&) = delete;
  StageProgress& operator=(const StageProgress&) = delete;
  ~StageProgress() {
    if (shown_) std::cerr << "\r\x1b[K" << std::flush;
  }

  void operator()(std::string_view stage, double share) {
    const Clock::time_point now = Clock::now();
    if (stage != stage_) {
      stage_ = stage;
      stage_start_ = now;
    }
    if (!terminal_ || now - start_ < std::chrono::seconds(2)) return;
    shown_ = true;
    std::cerr << "\r\x1b[K" << stage;
    const std::chrono::duration<double> taken = now - stage_start_;
    if (share > 0.0)
      std::cerr << ": " << std::lround(100.0 * share) << " %, about "
                << std::lround(taken.count() * (1.0 - share) / share) + 1 << " s left";
    std::cerr << std::flush;
  }

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point start_ = Clock::now();
  Clock::time_point stage_start_ = start_;
  std::string stage_;
  bool terminal_ = isatty(STDERR_FILENO) == 1;
  bool shown_ = false;
};

}  // namespace km
