#include "apps/lab/simulate/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "modules/core/text_table.hpp"

namespace km {
namespace {

constexpr double kRedrawInterval_s = 0.2;
constexpr std::size_t kBarWidth = 24;

int terminal_width() {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

}  // namespace

std::string duration_text(double seconds) {
  const auto s = static_cast<long>(std::ceil(std::max(0.0, seconds)));
  if (s < 60) return std::to_string(s) + " s";
  if (s < 3600) return std::to_string(s / 60) + " min " + std::to_string(s % 60) + " s";
  return std::to_string(s / 3600) + " h " + std::to_string(s / 60 % 60) + " min";
}

std::string size_text(double bytes) {
  return bytes < 1e9 ? fixed(bytes / 1e6, 1) + " MB" : fixed(bytes / 1e9, 1) + " GB";
}

Progress::Progress() : Progress(std::cout, isatty(STDOUT_FILENO) == 1, terminal_width()) {}

Progress::Progress(std::ostream& output, bool terminal, int width)
    : output_(output), terminal_(terminal), width_(static_cast<std::size_t>(std::max(width, 20))) {}

void Progress::start(std::size_t present, std::size_t total, double now_s) {
  present_ = present;
  total_ = total;
  start_s_ = now_s;
  draw(present, now_s);
}

void Progress::update(std::size_t done, double now_s) {
  if (now_s - drawn_s_ >= (terminal_ ? kRedrawInterval_s : kPlainInterval_s)) draw(done, now_s);
}

void Progress::finish(std::size_t done, double now_s) {
  draw(done, now_s);
  if (terminal_) output_ << std::endl;
}

std::string Progress::text(std::size_t done, double now_s) const {
  const double share = total_ == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total_);
  std::string line = std::to_string(done) + " of " + std::to_string(total_) + " frames, " +
                     fixed(std::floor(100.0 * share), 0) + " %";
  const double elapsed_s = now_s - start_s_;
  if (done <= present_ || elapsed_s <= 0.0) return line;
  const double per_s = static_cast<double>(done - present_) / elapsed_s;
  line += ", " + fixed(per_s, 1) + " frames/s";
  if (done < total_)
    line += ", " + duration_text(static_cast<double>(total_ - done) / per_s) + " left";
  return line;
}

void Progress::draw(std::size_t done, double now_s) {
  drawn_s_ = now_s;
  const std::string line = text(done, now_s);
  if (!terminal_) {
    output_ << line << std::endl;
    return;
  }
  const std::size_t filled = total_ == 0 ? kBarWidth : kBarWidth * done / total_;
  const std::string bar =
      '[' + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + "] ";
  output_ << "\r\x1b[K" << (bar + line).substr(0, width_ - 1) << std::flush;
}

}  // namespace km
