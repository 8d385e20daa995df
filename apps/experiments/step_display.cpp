#include "apps/experiments/step_display.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "apps/team/text_table.hpp"

namespace km {
namespace {

constexpr double kQuiet_s = 2.0;  // shorter steps only show their end
constexpr double kRedrawInterval_s = 0.2;

std::string duration(double seconds) {
  const auto s = static_cast<long>(std::lround(seconds));
  if (s < 10) return fixed(seconds, 1) + " s";
  if (s < 60) return std::to_string(s) + " s";
  if (s < 3600) return std::to_string(s / 60) + " min " + std::to_string(s % 60) + " s";
  return std::to_string(s / 3600) + " h " + std::to_string(s / 60 % 60) + " min";
}

}  // namespace

std::string rough_duration(double seconds) {
  const auto minutes = static_cast<long>(std::ceil(seconds / 60.0));
  if (minutes <= 1) return "less than a minute";
  if (minutes < 90) return "about " + std::to_string(minutes) + " min";
  return "about " + fixed(seconds / 3600.0, 1) + " h";
}

StepDisplay StepDisplay::standard_output() {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return {std::cout, isatty(STDOUT_FILENO) == 1, known ? size.ws_col : 80};
}

void StepDisplay::start(std::size_t index, std::size_t count, const std::string& title,
                        double expected_s, double later_s, double now_s) {
  heading_ = '[' + std::to_string(index) + '/' + std::to_string(count) + "] " + title;
  expected_s_ = expected_s;
  later_s_ = later_s;
  start_s_ = drawn_s_ = now_s;
}

std::string StepDisplay::text(const std::string& line, double now_s) const {
  const double elapsed_s = now_s - start_s_;
  // What takes longer than expected may end at once or late: no promise then.
  const std::string left =
      elapsed_s <= expected_s_
          ? rough_duration(expected_s_ - elapsed_s + later_s_) + " left"
          : "longer than expected" + (later_s_ > 0.0 ? ", then " + rough_duration(later_s_) : "");
  return heading_ + ": " + duration(elapsed_s) + ", " + left +
         (line.empty() ? std::string() : " | " + line);
}

void StepDisplay::update(const std::string& line, double now_s) {
  if (now_s - start_s_ < kQuiet_s) return;
  if (now_s - drawn_s_ < (terminal_ ? kRedrawInterval_s : kPlainInterval_s)) return;
  drawn_s_ = now_s;
  if (terminal_)
    output_ << "\r\x1b[K"
            << text(line, now_s).substr(0, static_cast<std::size_t>(std::max(width_, 20) - 1))
            << std::flush;
  else
    output_ << text(line, now_s) << std::endl;
}

void StepDisplay::finish(const std::string& result, double now_s) {
  output_ << (terminal_ ? "\r\x1b[K" : "") << heading_ << ": " << result << " in "
          << duration(now_s - start_s_) << std::endl;
}

}  // namespace km
